#include "capture/manifest.h"

#include <utility>

#include "capture/json_parts.h"
#include "capture/sequence_files.h"
#include "core/error.h"

namespace terracast::capture {

using core::ErrorKind;
using core::fail;
using core::Json;

Json json_from_manifest(const Manifest& manifest, const SequenceInfo& info,
                        const std::vector<FrameRecord>& records) {
  Json cameras = Json::array();
  for (std::size_t i = 0; i < info.cameras.size(); ++i) {
    const CameraCalibration& camera = info.cameras[i];
    std::int64_t num_sky = 0, num_outside = 0, num_edge = 0;
    for (const FrameRecord& record : records) {
      num_sky += record.cameras[i].num_sky;
      num_outside += record.cameras[i].num_outside;
      num_edge += record.cameras[i].num_edge;
    }
    const std::int64_t num_pixels =
        std::int64_t{camera.intrinsics.width_px} * camera.intrinsics.height_px;
    cameras.push(Json::object()
                     .set("rig", camera.rig)
                     .set("name", camera.name)
                     .set("num_pixels", num_pixels * static_cast<std::int64_t>(records.size()))
                     .set("num_sky", num_sky)
                     .set("num_outside", num_outside)
                     .set("num_edge", num_edge));
  }
  Json files = Json::array();
  for (const FrameFile& file : manifest.files) files.push(json_from_file(file));
  Json json = header();
  json.set("input_hash", manifest.input_hash)
      .set("num_frames", info.num_frames)
      .set("cameras", std::move(cameras))
      .set("files", std::move(files));
  core::add_content_hash(json);
  return json;
}

Manifest manifest_from_json(const Json& json, const SequenceInfo& info, const std::string& file) {
  const Source source{file};
  source.format(json);
  Manifest manifest;
  manifest.input_hash = json.at("input_hash").string();
  source.inputs(json, info);
  const Json& files = json.at("files");
  const std::size_t num_files = 2 + static_cast<std::size_t>(info.num_frames);
  if (!files.is_array() || files.size() != num_files)
    fail(ErrorKind::Input, "{}: files must be a list of {}", file, num_files);
  for (std::size_t i = 0; i < num_files; ++i) {
    const std::string path = i == 0   ? kSequenceFile
                             : i == 1 ? kTracksFile
                                      : record_path(static_cast<int>(i) - 2);
    manifest.files.push_back(file_from_json(files.at(i), path, file));
  }
  source.whole(json);
  return manifest;
}

}  // namespace terracast::capture
