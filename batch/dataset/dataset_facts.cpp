#include "batch/dataset/dataset_facts.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <regex>
#include <set>
#include <utility>

#include "core/error.h"
#include "geo/camera_model.h"

namespace terracast::batch {

using core::ErrorKind;
using core::fail;

void Publication::validate() const {
  if (name.empty()) fail(ErrorKind::Config, "a dataset needs a name");
  static const std::regex is_version(R"((0|[1-9]\d*)\.(0|[1-9]\d*)\.(0|[1-9]\d*))");
  if (!std::regex_match(version, is_version))
    fail(ErrorKind::Config, "version = \"{}\" must be like 1.0.0", version);
  static const std::regex is_day(R"(\d{4}-(0[1-9]|1[0-2])-(0[1-9]|[12]\d|3[01]))");
  if (!date_published.empty() && !std::regex_match(date_published, is_day))
    fail(ErrorKind::Config, "date_published = \"{}\" must be like 2025-06-21", date_published);
}

SequenceFacts sequence_facts(const std::string& run, const capture::SequenceReader& sequence) {
  const capture::SequenceInfo& info = sequence.info();
  SequenceFacts facts;
  facts.run = run;
  facts.sequence = info.name;
  facts.world = info.world_name;
  facts.num_frames = info.num_frames;
  facts.num_cameras = static_cast<int>(info.cameras.size());
  facts.utc_start = info.utc_start;
  const geo::WorldFrame frame(info.origin);
  double west_deg = 0.0;  // both counted on from the first longitude
  double east_deg = 0.0;
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  for (const capture::FrameRecord& record : sequence.frames()) {
    const Eigen::Vector3d& body_world = record.world_from_body.translation;
    const geo::Geodetic place = frame.geodetic_from_world(body_world);
    if (record.index == 0) {
      facts.lat_deg = facts.south_deg = facts.north_deg = place.lat_deg;
      facts.lon_deg = west_deg = east_deg = place.lon_deg;
      facts.lowest_m = facts.highest_m = place.height_m;
    } else {
      facts.track_length_m += (body_world - before).norm();
    }
    const double lon_deg = facts.lon_deg + std::remainder(place.lon_deg - facts.lon_deg, 360.0);
    facts.south_deg = std::min(facts.south_deg, place.lat_deg);
    facts.north_deg = std::max(facts.north_deg, place.lat_deg);
    west_deg = std::min(west_deg, lon_deg);
    east_deg = std::max(east_deg, lon_deg);
    facts.lowest_m = std::min(facts.lowest_m, place.height_m);
    facts.highest_m = std::max(facts.highest_m, place.height_m);
    facts.duration_s = record.time_s;
    before = body_world;
  }
  facts.west_deg = std::remainder(west_deg, 360.0);
  facts.east_deg = std::remainder(east_deg, 360.0);
  return facts;
}

std::vector<CameraFacts> camera_facts(const capture::SequenceInfo& sequence) {
  std::vector<CameraFacts> cameras;
  for (const capture::CameraCalibration& camera : sequence.cameras) {
    const geo::CameraIntrinsics& intrinsics = camera.intrinsics;
    CameraFacts& facts = cameras.emplace_back(CameraFacts{.rig = camera.rig,
                                                          .camera = camera.name,
                                                          .model = intrinsics.model,
                                                          .width_px = intrinsics.width_px,
                                                          .height_px = intrinsics.height_px});
    facts.focal_x_px = intrinsics.parameters[0];
    facts.focal_y_px = intrinsics.parameters[1];
  }
  return cameras;
}

std::vector<FileGroup> group_files(const DatasetFacts& facts) {
  std::set<std::string> formats;
  for (const SequenceFacts& sequence : facts.sequences)
    formats.insert(sequence.formats.begin(), sequence.formats.end());
  std::map<std::pair<std::string, std::string>, FileGroup> groups;
  for (const FileFacts& file : facts.files) {
    const std::string folder = file.path.substr(0, file.path.find('/'));
    if (folder.size() == file.path.size() || !formats.contains(folder)) continue;
    std::string extension = std::filesystem::path(file.path).extension().string();
    if (!extension.empty()) extension.erase(0, 1);
    FileGroup& group = groups[{folder, extension}];
    group.format = folder;
    group.extension = extension;
    ++group.num_files;
    group.num_bytes += file.num_bytes;
  }
  std::vector<FileGroup> result;
  for (auto& [key, group] : groups) result.push_back(std::move(group));
  return result;
}

}  // namespace terracast::batch
