// What `mote info` finds out about one file, as the object that --json prints; text for people is made from it.
#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "host/scene/scene.h"

namespace mote {

/// A particle file of any format: count, channels with the least, mean and greatest of their finite numbers and the one
/// of ours that each is, metadata, bounds and radius. Not-finite numbers are counted, never refused. Throws InputError
/// as readers do. Reads the particles once for every GiB of them, which it holds at once.
nlohmann::ordered_json describeParticles(const std::string& path);
void printParticles(const nlohmann::ordered_json& info);

/// An OpenEXR picture: size, channels, not-finite pixels, string attributes. Throws InputError as readExr does.
nlohmann::ordered_json describePicture(const std::string& path);
void printPicture(const nlohmann::ordered_json& info);

/// A scene and the memory that its frame takes; of particle files only the headers are read. Throws InputError where one
/// of them is wrong.
nlohmann::ordered_json describeScene(const Scene& scene, int frame);
void printScene(const nlohmann::ordered_json& info);

/// Decimal units: "950 B", "27.4 MB".
std::string bytesText(double bytes);

}  // namespace mote
