#include "host/particles/conversion_plan.h"

#include <fmt/format.h>

#include <algorithm>

#include "host/core/error.h"
#include "host/particles/formats/number_cast.h"
#include "host/particles/our_channels.h"

namespace mote {
namespace {

using Inputs = std::span<const std::unique_ptr<ParticleFile>>;

const ParticleSource kNoSource{};

PlannedChannel& plannedNamed(std::vector<PlannedChannel>& plan, const std::string& name, std::size_t inputs) {
  for (PlannedChannel& p : plan)
    if (p.written.channel.name == name) return p;
  plan.push_back({});
  plan.back().written.channel.name = name;
  plan.back().sources.resize(inputs);
  return plan.back();
}

/// Every channel of every input.
std::vector<PlannedChannel> allChannels(Inputs inputs, bool keepNames) {
  std::vector<PlannedChannel> plan;
  for (std::size_t k = 0; k < inputs.size(); ++k)
    for (const Channel& c : inputs[k]->channels()) {
      const std::string ours = ourNameOf(*inputs[k], c.name);
      PlannedChannel& planned = plannedNamed(plan, ours.empty() || keepNames ? c.name : ours, inputs.size());
      planned.ours = ours, planned.sources[k] = c;
    }
  return plan;
}

std::vector<PlannedChannel> chosenChannels(Inputs inputs, const ConversionOptions& options) {
  std::vector<PlannedChannel> plan;
  for (const auto& [ours, theirs] : options.channels) {
    PlannedChannel& planned = plannedNamed(plan, ours, inputs.size());
    if (isOurChannel(ours)) planned.ours = ours;
    for (std::size_t k = 0; k < inputs.size(); ++k) {
      const ParticleFile& file = *inputs[k];
      const std::string name = theirs.empty() ? nameInFile(kNoSource, file, ours).theirs : theirs;
      if (const Channel* c = file.channel(name)) planned.sources[k] = *c;
    }
    if (std::none_of(planned.sources.begin(), planned.sources.end(), [](const auto& c) { return c.has_value(); }))
      throw InputError(inputs[0]->path(), "--channels", fmt::format("a channel '{}'", theirs.empty() ? ours : theirs),
                       "none of that name", "it has " + describeChannels(inputs[0]->channels()));
  }
  return plan;
}

/// What particles get that have no such channel: what the renderer takes where none has it.
double fillFor(const ParticleFile& file, const PlannedChannel& planned) {
  for (const char* needed : {"Position", "Radius", "ID", "Absorption"})
    if (planned.ours == needed)
      throw InputError(file.path(), "", fmt::format("a channel '{}', as other inputs have it", needed), "none",
                       fmt::format("it has {}; --channels leaves a channel out", describeChannels(file.channels())));
  return planned.ours == "Density" || planned.ours == "Color" ? 1 : 0;
}

/// One channel that holds the numbers of all sources.
void unite(Inputs inputs, PlannedChannel& planned) {
  Channel* united = nullptr;
  Channel& channel = planned.written.channel;
  for (std::size_t k = 0; k < inputs.size(); ++k) {
    const std::optional<Channel>& source = planned.sources[k];
    if (!source) continue;
    if (!united) {
      united = &channel;
      channel = {channel.name, source->type, source->arity, source->scale};
      planned.written.from = source->name;
      continue;
    }
    if (source->arity != channel.arity)
      throw InputError(inputs[k]->path(), fmt::format("channel '{}'", source->name),
                       fmt::format("arity {}, as other inputs have it", channel.arity),
                       fmt::format("arity {}", source->arity), "--channels leaves a channel out");
    if (source->scale != channel.scale || (channel.scale != 1 && source->type != channel.type))
      channel.type = NumberType::F32, channel.scale = 1;  // shares of different numbers
    else
      channel.type = commonType(channel.type, source->type);
  }
  planned.written.fromType = channel.type;
  for (std::size_t k = 0; k < inputs.size(); ++k) {
    if (planned.sources[k]) continue;
    planned.written.fill = fillFor(*inputs[k], planned) / channel.scale;
    planned.written.filled += inputs[k]->count();
  }
}

bool isMoved(const PlannedChannel& planned) {
  return planned.ours == "Position" || planned.ours == "Velocity" || planned.ours == "Radius";
}

/// The types that were asked for, or that moving particles takes.
void chooseType(const ConversionOptions& options, PlannedChannel& planned) {
  Channel& channel = planned.written.channel;
  if (options.moves() && isMoved(planned) && !isFloat(channel.type))
    channel.type = numberSize(channel.type) <= 2 ? NumberType::F32 : NumberType::F64, channel.scale = 1;
  const auto asked = options.types.find(channel.name);
  if (asked != options.types.end()) channel.type = asked->second, channel.scale = 1;
}

/// As the format has it, under a name of its own.
void store(Inputs inputs, const ConversionOptions& options, std::span<const PlannedChannel> before,
           PlannedChannel& planned) {
  const Channel wanted = planned.written.channel;
  Channel& channel = planned.written.channel;
  channel = storedChannel(options.format, wanted);
  // A PRT 1.x whose positions are float64 stays what it is.
  const bool fromPrt1 =
      std::all_of(inputs.begin(), inputs.end(), [](const auto& file) { return file->format().starts_with("PRT 1."); });
  if (fromPrt1 && options.format == OutputFormat::Prt1) channel.type = wanted.type;
  constexpr std::size_t kRoom = 3;  // PRT's names are short
  const std::string base = channel.name;
  for (int number = 2; std::any_of(before.begin(), before.end(),
                                   [&](const PlannedChannel& p) { return p.written.channel.name == channel.name; });
       ++number)
    channel.name = storedChannel(options.format, {base.substr(0, 31 - kRoom) + "_" + std::to_string(number)}).name;
}

void requireTypesUsed(const ConversionOptions& options, std::span<const PlannedChannel> channels) {
  for (const auto& entry : options.types) {
    const std::string& name = entry.first;
    if (std::none_of(channels.begin(), channels.end(), [&](const auto& p) { return p.written.channel.name == name; })) {
      std::string names;
      for (const PlannedChannel& p : channels) names += (names.empty() ? "" : ", ") + p.written.channel.name;
      throw InputError("--type", "", "a channel that is written: " + names, fmt::format("'{}'", name));
    }
  }
}

/// Values of the first input, for the channels as they are now called.
void planMetadata(Inputs inputs, const ConversionOptions& options, ConversionPlan& plan) {
  const bool sameNumbers = inputs.size() == 1 && !options.moves() && options.subsample == 1;
  std::vector<Metadata> kept;
  std::vector<Channel> channels;
  for (const PlannedChannel& p : plan.channels) channels.push_back(p.written.channel);
  for (Metadata m : inputs[0]->metadata()) {
    // Ranges of numbers that are others now.
    if (!sameNumbers && !m.channel.empty() && (m.name == "Extents" || m.name == "ChannelRange")) continue;
    if (!m.channel.empty()) {
      const auto planned = std::find_if(plan.channels.begin(), plan.channels.end(), [&](const PlannedChannel& p) {
        return p.sources[0] && p.sources[0]->name == m.channel;
      });
      if (planned == plan.channels.end()) continue;
      m.channel = planned->written.channel.name;
    }
    for (std::size_t k = 1; k < inputs.size(); ++k) {
      const Metadata* other = inputs[k]->meta("", m.name);
      if (m.channel.empty() && m.name != "BoundBox" && other && (other->type != m.type || other->bytes != m.bytes)) {
        plan.notes.push_back(
            fmt::format("{} is not the same in all inputs; it is that of {}", m.name, inputs[0]->path()));
        break;
      }
    }
    kept.push_back(std::move(m));
  }
  plan.metadata = storedMetadata(options.format, kept, channels, plan.lostMetadata);
}

void planNotes(const ConversionOptions& options, ConversionPlan& plan) {
  std::size_t numbers = 0;
  const PlannedChannel* position = nullptr;
  const bool hasDensity = std::any_of(plan.channels.begin(), plan.channels.end(),
                                      [](const PlannedChannel& p) { return p.ours == "Density"; });
  for (const PlannedChannel& p : plan.channels) {
    numbers += p.written.channel.arity;
    if (p.ours == "Position") position = &p;
    if (options.moves() && (p.written.channel.name == "Orientation" || p.written.channel.name == "Spin"))
      plan.notes.push_back(p.written.channel.name + " is not rotated");
  }
  if (!position || position->written.channel.arity < 3)
    plan.notes.push_back("there is no Position of three numbers: nothing can be rendered from it");
  if (options.format == OutputFormat::Csv && numbers < 3)
    plan.notes.push_back("mote itself reads no table of fewer than three columns");
  if (options.scale != 1 && hasDensity)
    plan.notes.push_back(
        fmt::format("Density is as it was: with medium.density_scale {:g} times as large the picture "
                    "stays the same (in mode peak as it is)",
                    options.scale * options.scale));
}

}  // namespace

ConversionPlan planConversion(std::span<const std::unique_ptr<ParticleFile>> inputs, const std::string& path,
                              const ConversionOptions& options) {
  MOTE_CHECK(inputs.size(), >, 0u);
  ConversionPlan plan;
  plan.channels = options.channels.empty() ? allChannels(inputs, options.keepNames) : chosenChannels(inputs, options);
  if (plan.channels.empty()) throw InputError(inputs[0]->path(), "", "at least one channel", "none");
  for (PlannedChannel& planned : plan.channels) {
    unite(inputs, planned);
    chooseType(options, planned);
  }
  requireTypesUsed(options, plan.channels);
  for (std::size_t k = 0; k < plan.channels.size(); ++k)
    store(inputs, options, std::span(plan.channels).first(k), plan.channels[k]);
  for (const PlannedChannel& planned : plan.channels)
    if (options.moves() && (planned.ours == "Position" || planned.ours == "Velocity") &&
        planned.written.channel.arity < 3)
      throw InputError(path, fmt::format("channel '{}'", planned.written.channel.name), "three numbers to move",
                       fmt::format("{}", planned.written.channel.arity));
  planMetadata(inputs, options, plan);
  planNotes(options, plan);
  return plan;
}

}  // namespace mote
