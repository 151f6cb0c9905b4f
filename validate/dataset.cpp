#include "validate/dataset.h"

#include <algorithm>
#include <limits>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/image_io.h"
#include "core/registry.h"
#include "validate/npy.h"
#include "validate/readers/coco.h"
#include "validate/readers/colmap.h"
#include "validate/readers/euroc.h"
#include "validate/readers/kitti.h"
#include "validate/readers/kitti_object.h"
#include "validate/readers/kitti_raw.h"
#include "validate/readers/mcap.h"
#include "validate/readers/tartanair.h"
#include "validate/readers/tartanair_v1.h"
#include "validate/readers/terracast.h"
#include "validate/readers/tum.h"

namespace terracast::validate {

namespace {

using core::ErrorKind;
using core::fail;

void check_size(int width, int height, const Intrinsics& size, const std::string& name) {
  if (size.width_px > 0 && (width != size.width_px || height != size.height_px))
    fail(ErrorKind::Input, "{}: {} x {} pixels where {} x {} should be", name, width, height,
         size.width_px, size.height_px);
}

/// The largest camera that a rig may hold has 16384 x 16384 pixels.
constexpr std::size_t kMostPixels = std::size_t{1} << 28;
/// Its depth in float32 has 2^30 bytes behind a header.
constexpr std::size_t kMostBytes = std::size_t{1} << 31;

template <class Pixel>
core::Image<Pixel> read_png(const std::filesystem::path& file, const std::string& name,
                            int channels, const Intrinsics& size) {
  auto decoded = core::decode_png(core::read_file(file, kMostBytes), name, kMostPixels);
  auto* image = std::get_if<core::Image<Pixel>>(&decoded);
  if (image == nullptr)
    fail(ErrorKind::Input, "{}: a PNG of {} bits a channel is right", name, 8 * sizeof(Pixel));
  check_size(image->width(), image->height(), size, name);
  if (channels > 0 && image->channels() != channels)
    fail(ErrorKind::Input, "{}: {} channels where {} should be", name, image->channels(), channels);
  return std::move(*image);
}

}  // namespace

int Sequence::camera_index(const std::string& camera_name) const {
  for (std::size_t i = 0; i < cameras.size(); ++i)
    if (cameras[i].name == camera_name) return static_cast<int>(i);
  return -1;
}

bool Sequence::has_rolling_shutters() const {
  return std::any_of(cameras.begin(), cameras.end(),
                     [](const Camera& camera) { return camera.shutter.has_value(); });
}

core::ImageF Reader::disparity(const Dataset& dataset, const Camera& camera, int) const {
  fail(ErrorKind::Internal, "{} holds no disparity (asked for {})", dataset.format, camera.name);
}

FlowFields Reader::flow(const Dataset& dataset, const Camera& camera, int) const {
  fail(ErrorKind::Internal, "{} holds no flow (asked for {})", dataset.format, camera.name);
}

core::ImageF Reader::normals(const Dataset& dataset, const Camera& camera, int) const {
  fail(ErrorKind::Internal, "{} holds no normals (asked for {})", dataset.format, camera.name);
}

core::ImageU32 Reader::instances(const Dataset& dataset, const Camera& camera, int) const {
  fail(ErrorKind::Internal, "{} holds no instances (asked for {})", dataset.format, camera.name);
}

core::Image8 Reader::color(const Dataset& dataset, const Camera& camera, int frame) const {
  const std::string& path = camera.files[static_cast<std::size_t>(frame)].color;
  core::Image8 image = is_part_of_bag(path)
                           ? read_bag_image(dataset, path, camera.intrinsics)
                           : read_png8(dataset.root / path, path, 0, camera.intrinsics);
  if (image.channels() == 3) return image;
  if (image.channels() != 1)
    fail(ErrorKind::Input, "{}: {} channels where 3 (colour) or 1 (grey) should be", path,
         image.channels());
  core::Image8 color(image.width(), image.height(), 3);
  for (std::size_t i = 0; i < image.data().size(); ++i)
    for (std::size_t c = 0; c < 3; ++c) color.data()[3 * i + c] = image.data()[i];
  return color;
}

core::Image8 Reader::segmentation(const Dataset& dataset, const Camera& camera, int frame) const {
  const std::string& path = camera.files[static_cast<std::size_t>(frame)].segmentation;
  return read_png8(dataset.root / path, path, 1, camera.intrinsics);
}

namespace {

/// Every reader, by its format's name, in alphabetical order.
const std::map<std::string, std::unique_ptr<const Reader>>& readers() {
  static const auto table = [] {
    std::map<std::string, std::unique_ptr<const Reader>> all;
    all["coco"] = std::make_unique<CocoReader>();
    all["colmap"] = std::make_unique<ColmapReader>();
    all["euroc"] = std::make_unique<EurocReader>();
    all["kitti"] = std::make_unique<KittiReader>();
    all["kitti_object"] = std::make_unique<KittiObjectReader>();
    all["kitti_raw"] = std::make_unique<KittiRawReader>();
    all["mcap"] = std::make_unique<McapReader>();
    all["tartanair"] = std::make_unique<TartanAirReader>();
    all["tartanair_v1"] = std::make_unique<TartanAirV1Reader>();
    all["terracast"] = std::make_unique<TerracastReader>();
    all["tum"] = std::make_unique<TumReader>();
    return all;
  }();
  return table;
}

}  // namespace

std::vector<std::string> reader_names() {
  std::vector<std::string> names;
  for (const auto& [name, reader] : readers()) names.push_back(name);
  return names;
}

const Reader& find_reader(const std::string& format) {
  const auto found = readers().find(format);
  if (found == readers().end())
    fail(ErrorKind::Config, "{}", core::unknown_name_message("format", format, reader_names()));
  return *found->second;
}

std::string frame_digits(int frame, int num_digits) {
  return fmt::format("{:0{}}", frame, num_digits);
}

std::vector<std::string> list_folder(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (std::filesystem::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error))
    names.push_back(entry->path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

bool is_safe_relative_path(const std::string& path) {
  const std::filesystem::path p(path);
  if (path.empty() || path.find('\0') != std::string::npos || p.is_absolute()) return false;
  return std::none_of(p.begin(), p.end(), [](const auto& part) { return part == ".."; });
}

std::vector<std::string> numbered_files(const Dataset& dataset, const std::string& folder,
                                        const std::string& suffix, int num_frames,
                                        Findings& findings, bool is_optional, int num_digits) {
  const std::vector<std::string> found = list_folder(dataset.root / folder);
  std::vector<std::string> paths(static_cast<std::size_t>(num_frames));
  if (is_optional && found.empty()) {
    const auto listed = dataset.files.lower_bound(folder + "/");
    if (listed == dataset.files.end() || !listed->first.starts_with(folder + "/")) return paths;
  }
  std::size_t num_known = 0;
  for (int i = 0; i < num_frames; ++i) {
    const std::string file = frame_digits(i, num_digits) + suffix;
    if (std::binary_search(found.begin(), found.end(), file)) {
      paths[static_cast<std::size_t>(i)] = folder + "/" + file;
      ++num_known;
    } else {
      findings.add(folder + "/" + file, "missing");
    }
  }
  if (found.size() != num_known)
    findings.add(
        folder,
        fmt::format("{} files that are not \"{}{}\" of a frame; readers pair files by their place "
                    "in the list",
                    found.size() - num_known,
                    std::string(static_cast<std::size_t>(num_digits), 'N'), suffix));
  return paths;
}

core::Image8 read_png8(const std::filesystem::path& file, const std::string& name, int channels,
                       const Intrinsics& size) {
  return read_png<std::uint8_t>(file, name, channels, size);
}

core::Image16 read_png16(const std::filesystem::path& file, const std::string& name, int channels,
                         const Intrinsics& size) {
  return read_png<std::uint16_t>(file, name, channels, size);
}

core::ImageF read_depth_npy(const std::filesystem::path& file, const std::string& name,
                            const Intrinsics& size) {
  const NpyArray array = parse_npy(core::read_file(file, kMostBytes), name);
  if (array.shape.size() != 2 || array.shape[0] > (1U << 15) || array.shape[1] > (1U << 15))
    fail(ErrorKind::Input, "{}: an array of {} dimensions where (height, width) should be", name,
         array.shape.size());
  check_size(static_cast<int>(array.shape[1]), static_cast<int>(array.shape[0]), size, name);
  core::ImageF depth(static_cast<int>(array.shape[1]), static_cast<int>(array.shape[0]));
  const std::vector<float> values = array.floats(name);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const float value = values[i];
    if (!(value >= 0.0F) || value == std::numeric_limits<float>::infinity())
      fail(ErrorKind::Input,
           "{}: depth {} at pixel ({}, {}); a finite depth, or 0 for none, is right", name, value,
           i % array.shape[1], i / array.shape[1]);
    depth.data()[i] = value > 0.0F ? value : std::numeric_limits<float>::quiet_NaN();
  }
  return depth;
}

}  // namespace terracast::validate
