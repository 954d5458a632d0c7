#include "host/particles/conversion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "host/core/parallel.h"
#include "host/core/sampling.h"
#include "host/particles/conversion_plan.h"
#include "host/particles/formats/block_reader.h"
#include "host/particles/formats/number_cast.h"
#include "host/particles/placement.h"

namespace mote {
namespace {

using Bytes = std::vector<std::byte>;

constexpr std::size_t kGrain = 1 << 13;

/// What moves particles, in double.
struct Motion {
  explicit Motion(const ConversionOptions& options)
      : rotation(rotationAbout(options.rotate)), linear(rotation * options.scale), options_(options) {}

  /// In place, `arity` numbers a particle.
  void apply(const PlannedChannel& channel, std::vector<double>& numbers) const {
    const std::size_t arity = channel.written.channel.arity;
    const std::string& ours = channel.ours;
    const bool place = ours == "Position", radius = ours == "Radius";
    if (radius) {
      for (double& number : numbers) number *= options_.scale;
      return;
    }
    const glm::dmat3& matrix = place || ours == "Velocity" ? linear : rotation;
    const dvec3 translate = place ? options_.translate : dvec3(0);
    parallelBlocks(numbers.size() / arity, kGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        double* at = &numbers[i * arity];
        const dvec3 moved = matrix * dvec3(at[0], at[1], at[2]) + translate;
        at[0] = moved.x, at[1] = moved.y, at[2] = moved.z;
      }
    });
  }
  /// Which channels it moves.
  bool moves(const PlannedChannel& channel) const {
    if (!options_.moves()) return false;
    if (channel.ours == "Position" || channel.ours == "Velocity" || channel.ours == "Radius") return true;
    if (channel.written.channel.arity != 3 || !isFloat(channel.written.channel.type)) return false;
    const std::string& name = channel.written.channel.name;
    return name == "Normal" || name == "Tangent" || name == "Binormal";
  }

  glm::dmat3 rotation, linear;

 private:
  const ConversionOptions& options_;
};

std::span<std::byte> bytesOf(std::vector<double>& numbers) { return std::as_writable_bytes(std::span(numbers)); }

/// A column as the file gets it, in `out`, or as it came where nothing changes.
std::span<const std::byte> converted(const Channel& source, std::span<const std::byte> column, const Motion& motion,
                                     PlannedChannel& planned, Bytes& out) {
  const Channel& target = planned.written.channel;
  const std::size_t numbers = column.size() / numberSize(source.type);
  const bool moves = motion.moves(planned), shares = source.scale != target.scale;
  if (!moves && !shares && source.type == target.type) return column;
  out.resize(numbers * numberSize(target.type));
  if (!moves && !shares) {
    planned.written.changed += castNumbers(source.type, column, target.type, out);
    return out;
  }
  std::vector<double> wide(numbers);
  castNumbers(source.type, column, NumberType::F64, bytesOf(wide));
  if (shares)
    for (double& number : wide) number *= source.scale;
  if (moves) motion.apply(planned, wide);
  castNumbers(NumberType::F64, bytesOf(wide), target.type, out);
  return out;
}

std::span<const std::byte> filled(std::size_t count, const WrittenChannel& written, Bytes& out) {
  std::vector<double> numbers(count * written.channel.arity, written.fill);
  out.resize(numbers.size() * numberSize(written.channel.type));
  castNumbers(NumberType::F64, bytesOf(numbers), written.channel.type, out);
  return out;
}

/// Which particles are written.
class Sample {
 public:
  Sample(std::span<const std::unique_ptr<ParticleFile>> inputs, const ConversionOptions& options,
         std::span<const PlannedChannel> channels, std::vector<std::string>& notes)
      : options_(options) {
    if (options.subsample == 1) return;
    readIds(inputs, channels);
    if (ids_.empty()) return;
    if (const double share = meanIdShare(ids_); share > kMostIdShare) {
      notes.push_back(
          fmt::format("ID is no name of a particle ({:.0f} share one in the mean): the sub-sample goes by the "
                      "index, which may choose others in another frame",
                      share));
      ids_.clear();
    }
  }

  /// Of `count` particles behind those asked before, the ones to write; all: an empty list.
  void choose(std::size_t count, std::vector<std::size_t>& chosen) {
    chosen.clear();
    if (options_.subsample == 1) return;
    for (std::size_t i = 0; i < count; ++i, ++index_)
      if (isSampled(ids_.empty() ? index_ : ids_[index_], options_.seed, options_.subsample)) chosen.push_back(i);
  }

 private:
  /// By ID where every input has one: the same particles in every frame.
  void readIds(std::span<const std::unique_ptr<ParticleFile>> inputs, std::span<const PlannedChannel> channels) {
    const auto id = std::find_if(channels.begin(), channels.end(), [](const auto& c) { return c.ours == "ID"; });
    for (std::size_t k = 0; k < inputs.size(); ++k) {
      const Channel* channel =
          id != channels.end() && id->sources[k] ? inputs[k]->channel(id->sources[k]->name) : inputs[k]->channel("ID");
      if (!channel || channel->arity != 1) return ids_.clear();
      std::vector<std::uint64_t> own;
      const ChannelRequest request{channel->name, &own};
      inputs[k]->read({&request, 1});
      ids_.insert(ids_.end(), own.begin(), own.end());
    }
  }

  const ConversionOptions& options_;
  std::vector<std::uint64_t> ids_;  ///< empty: by the index
  std::uint64_t index_ = 0;
};

std::span<const std::byte> gathered(std::span<const std::byte> column, std::size_t bytes,
                                    std::span<const std::size_t> chosen, Bytes& out) {
  out.resize(chosen.size() * bytes);
  for (std::size_t i = 0; i < chosen.size(); ++i) std::memcpy(&out[i * bytes], &column[chosen[i] * bytes], bytes);
  return out;
}

/// Buffers of one channel, kept from block to block.
struct Buffers {
  Bytes sampled, converted;
};

void convertInput(const ParticleFile& file, std::size_t input, const ConversionOptions& options, Sample& sample,
                  std::vector<PlannedChannel>& plan, ParticleWriter& writer) {
  std::vector<std::string> names;  // each once
  std::vector<std::size_t> where;  // of each planned channel, in `names`
  for (const PlannedChannel& planned : plan) {
    if (!planned.sources[input]) {
      where.push_back(0);
      continue;
    }
    const std::string& name = planned.sources[input]->name;
    const auto found = std::find(names.begin(), names.end(), name);
    where.push_back(static_cast<std::size_t>(found - names.begin()));
    if (found == names.end()) names.push_back(name);
  }
  if (names.empty()) names.push_back(file.channels()[0].name);  // for the number of particles
  const Motion motion(options);
  std::vector<Buffers> buffers(plan.size());
  std::vector<std::span<const std::byte>> columns(plan.size());
  std::vector<std::size_t> chosen;
  readBlocks(file, names, [&](std::span<const std::span<const std::byte>> block, std::size_t count) {
    sample.choose(count, chosen);
    const bool all = options.subsample == 1;
    if (!all && chosen.empty()) return;
    for (std::size_t k = 0; k < plan.size(); ++k) {
      const std::optional<Channel>& source = plan[k].sources[input];
      if (!source) {
        columns[k] = filled(all ? count : chosen.size(), plan[k].written, buffers[k].converted);
        continue;
      }
      std::span<const std::byte> column = block[where[k]];
      if (!all) column = gathered(column, source->bytes(), chosen, buffers[k].sampled);
      columns[k] = converted(*source, column, motion, plan[k], buffers[k].converted);
    }
    writer.write(columns);
  });
}

}  // namespace

ConversionReport convertParticles(std::span<const std::unique_ptr<ParticleFile>> inputs, const std::string& path,
                                  const ConversionOptions& options) {
  ConversionPlan plan = planConversion(inputs, path, options);
  ConversionReport report;
  report.path = path, report.format = std::string(formatName(options.format));
  report.lostMetadata = plan.lostMetadata, report.notes = plan.notes;
  std::vector<Channel> channels;
  for (const PlannedChannel& planned : plan.channels) channels.push_back(planned.written.channel);
  const std::unique_ptr<ParticleWriter> writer =
      createParticleFile(options.format, path, std::move(channels), std::move(plan.metadata), options.write);
  Sample sample(inputs, options, plan.channels, report.notes);
  for (std::size_t k = 0; k < inputs.size(); ++k) {
    convertInput(*inputs[k], k, options, sample, plan.channels, *writer);
    report.read += inputs[k]->count();
  }
  writer->finish();
  report.written = writer->count(), report.bytes = writer->bytes();
  for (const PlannedChannel& planned : plan.channels) {
    report.channels.push_back(planned.written);
    if (options.format == OutputFormat::Prt1 && planned.ours == "Position" && planned.written.changed > 0)
      report.notes.push_back("positions were rounded to PRT 1.1's float32; --format prt2 keeps them");
  }
  return report;
}

}  // namespace mote
