// Exported datasets, of which an input replaces files.

#include <array>
#include <filesystem>
#include <set>
#include <string>

#include "tests/fuzz/scratch.h"
#include "tests/fuzz/small_dataset.h"
#include "validate/dataset.h"
#include "validate/evaluate/results/cloud_files.h"
#include "validate/readers/clouds.h"
#include "validate/readers/colmap_database.h"
#include "validate/readers/colmap_model.h"
#include "validate/readers/georegistration.h"
#include "validate/readers/mcap_container.h"
#include "validate/readers/nmea.h"
#include "validate/readers/rinex.h"
#include "validate/readers/ros_values.h"
#include "validate/readers/sensors.h"
#include "validate/readers/velodyne.h"

namespace terracast::fuzz {
namespace {

using Names = std::set<std::string_view>;

/// What the replaced files hold of a frame of a camera.
void read_frame(const validate::Dataset& dataset, const validate::Camera& camera, int frame,
                const Names& replaced, validate::Findings& findings) {
  const validate::Reader& reader = validate::find_reader(dataset.format);
  const validate::FrameFiles& files = camera.files[static_cast<std::size_t>(frame)];
  const auto attempt = [&](const std::string& file, const auto& read) {
    if (replaced.contains(file)) findings.attempt(file, read);
  };
  attempt(files.color, [&] { reader.color(dataset, camera, frame); });
  attempt(files.depth, [&] { reader.depth(dataset, camera, frame); });
  attempt(files.segmentation, [&] { reader.segmentation(dataset, camera, frame); });
  attempt(files.flow, [&] { reader.flow(dataset, camera, frame); });
  attempt(files.disparity, [&] { reader.disparity(dataset, camera, frame); });
  attempt(files.normals, [&] { reader.normals(dataset, camera, frame); });
  attempt(files.instances, [&] { reader.instances(dataset, camera, frame); });
}

void read_replaced(const std::filesystem::path& folder, const std::string& format,
                   const Names& replaced) {
  validate::Findings findings;
  const validate::Dataset dataset = validate::read_dataset(folder, format, findings);
  const validate::Reader& reader = validate::find_reader(dataset.format);
  for (const validate::Sequence& sequence : dataset.sequences) {
    reader.check_mounts(sequence, findings);
    findings.attempt("sensors.json", [&] { validate::read_sensors(dataset, sequence); });
    for (const validate::Camera& camera : sequence.cameras)
      for (std::size_t frame = 0; frame < camera.files.size(); ++frame)
        read_frame(dataset, camera, static_cast<int>(frame), replaced, findings);
  }
  findings.lines();
}

/// Each part of the input replaces the file of its name; a part of another name replaces none.
void replace_and_read(const SmallDataset& dataset, const std::string& format, Bytes input) {
  Names replaced;
  for (const Part& part : parts_of(input))
    if (dataset.files().contains(part.name)) {
      write_bytes(dataset.folder() / part.name, part.bytes);
      replaced.insert(part.name);
    }
  const auto restore = [&] {
    for (const std::string_view name : replaced)
      write_bytes(dataset.folder() / name, dataset.files().find(name)->second);
  };
  if (replaced.empty()) return;
  try {
    read_replaced(dataset.folder(), format, replaced);
  } catch (...) {
    restore();
    throw;
  }
  restore();
}

}  // namespace

#define TERRACAST_FUZZ_DATASET(format)          \
  void fuzz_dataset_##format(Bytes input) {     \
    static const SmallDataset dataset(#format); \
    replace_and_read(dataset, #format, input);  \
  }
TERRACAST_FUZZ_DATASET(coco)
TERRACAST_FUZZ_DATASET(colmap)
TERRACAST_FUZZ_DATASET(euroc)
TERRACAST_FUZZ_DATASET(kitti)
TERRACAST_FUZZ_DATASET(kitti_object)
TERRACAST_FUZZ_DATASET(kitti_raw)
TERRACAST_FUZZ_DATASET(mcap)
TERRACAST_FUZZ_DATASET(tartanair)
TERRACAST_FUZZ_DATASET(tartanair_v1)
TERRACAST_FUZZ_DATASET(terracast)
TERRACAST_FUZZ_DATASET(tum)
#undef TERRACAST_FUZZ_DATASET

void fuzz_cloud_las(Bytes input) { validate::parse_las(input, "fuzz.las"); }
void fuzz_cloud_pcd(Bytes input) { validate::parse_pcd(input, "fuzz.pcd"); }
void fuzz_cloud_ply(Bytes input) { validate::parse_ply(input, "fuzz.ply"); }

void fuzz_nmea(Bytes input) { validate::parse_nmea(text_of(input), 20, "fuzz.nmea"); }
void fuzz_rinex_navigation(Bytes input) {
  validate::parse_rinex_navigation(text_of(input), "fuzz.rnx");
}
void fuzz_rinex_observations(Bytes input) {
  validate::parse_rinex_observations(text_of(input), "fuzz.rnx");
}
void fuzz_lidar_instances(Bytes input) {
  validate::parse_instances(std::string(reinterpret_cast<const char*>(input.data()), input.size()),
                            "instances.csv");
}
void fuzz_lidar_labels(Bytes input) {
  for (const validate::ScanLabel& label : validate::parse_labels(input, "fuzz.label"))
    validate::has_instances(validate::is_semantic_kitti_label(label.label) ? label.label : 0);
}
void fuzz_lidar_ply(Bytes input) { validate::parse_lidar_ply(input, "fuzz.ply"); }
void fuzz_lidar_velodyne(Bytes input) {
  validate::parse_velodyne_float64(input);
  validate::parse_velodyne(input, "fuzz.bin");
}

/// Clouds that methods write. The first byte, a digit, chooses the form.
void fuzz_result_cloud(Bytes input) {
  static constexpr std::array<const char*, 6> kNames = {"a.ply",        "a.pcd",        "a.las",
                                                        "points3D.bin", "points3D.txt", "a.xyz"};
  if (input.empty()) return;
  validate::parse_point_cloud(input.subspan(1), kNames[std::to_integer<std::size_t>(input[0]) % 6]);
}

/// COLMAP's models by themselves, without a dataset around them: parts are files of a folder.
void fuzz_colmap_model(Bytes input) {
  static constexpr std::array<std::string_view, 10> kNames = {
      "cameras.bin", "images.bin", "points3D.bin", "rigs.bin", "frames.bin",
      "cameras.txt", "images.txt", "points3D.txt", "rigs.txt", "frames.txt"};
  const std::filesystem::path folder = put_parts(input, kNames);
  validate::Findings findings;
  validate::read_colmap_text(folder, "sparse", findings);
  validate::read_colmap_binary(folder, "sparse", findings);
  findings.lines();
}

void fuzz_colmap_database(Bytes input) {
  validate::read_colmap_database(put("database.db", input), "database.db");
}

/// A bag by itself, and its messages by the definitions that it has of them.
void fuzz_mcap(Bytes input) {
  const std::filesystem::path file = put("small.mcap", input);
  const validate::BagFile bag = validate::read_bag_file(file, "small.mcap");
  for (const auto& [name, topic] : bag.topics) {
    const validate::RosDefinition definition(*topic.definition, name);
    for (const validate::BagMessage& message : topic.messages)
      definition.read(
          validate::read_bytes_at(file, "small.mcap", message.offset, message.num_bytes),
          message.num_bytes);
  }
}

void fuzz_georegistration(Bytes input) {
  validate::read_georegistration(put("places.txt", input), "places.txt");
}

}  // namespace terracast::fuzz
