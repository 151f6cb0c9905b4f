#include "labels/label_image.h"

#include <algorithm>

#include "core/atomic_file.h"
#include "core/error.h"

namespace terracast::labels {
namespace {

constexpr const char* kSourceAttribute = "terracast.capture_manifest";

}  // namespace

bool is_label_image_done(const std::filesystem::path& file, const std::string& source,
                         const geo::CameraIntrinsics& image, std::string_view part_name,
                         std::string_view channel) {
  if (!std::filesystem::exists(file)) return false;
  try {
    const std::vector<core::ExrImage> parts =
        core::decode_exr(core::read_file(file), file.string());
    if (parts.size() != 1) return false;
    const auto attribute = parts[0].attributes.find(kSourceAttribute);
    const std::string name(channel);
    return parts[0].name == part_name && attribute != parts[0].attributes.end() &&
           attribute->second == source && parts[0].width == image.width_px &&
           parts[0].height == image.height_px &&
           (parts[0].uint_channels.contains(name) || parts[0].float_channels.contains(name));
  } catch (const core::Error& error) {
    if (error.kind() == core::ErrorKind::Input) return false;
    throw;
  }
}

std::vector<std::byte> encode_label_image(const std::string& source,
                                          const geo::CameraIntrinsics& image,
                                          const std::string& part_name,
                                          std::vector<core::ExrChannel> channels) {
  core::ExrPart part;
  part.name = part_name;
  part.width = image.width_px;
  part.height = image.height_px;
  part.channels = std::move(channels);
  part.attributes[kSourceAttribute] = source;
  return core::encode_exr({part});
}

void write_label_image(const std::filesystem::path& file, const std::string& source,
                       const geo::CameraIntrinsics& image, const std::string& part_name,
                       std::vector<core::ExrChannel> channels) {
  core::write_file(file, encode_label_image(source, image, part_name, std::move(channels)));
}

}  // namespace terracast::labels
