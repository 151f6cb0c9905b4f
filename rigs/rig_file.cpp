#include "rigs/rig_file.h"

#include <algorithm>
#include <set>
#include <utility>

#include "capture/sequence_files.h"
#include "core/error.h"
#include "core/schema_writer.h"
#include "core/toml_reader.h"
#include "geo/frames.h"

namespace terracast::rigs {
namespace {

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    lines.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return lines;
}

}  // namespace

rigs::RigOptions read_rig(const std::filesystem::path& file) {
  return core::with_context([&] { return core::read_toml<rigs::RigOptions>(file); },
                            fmt::format("reading the rig {}", file.string()));
}

std::string rig_toml(const rigs::RigOptions& rig) {
  rigs::RigOptions defaults;
  defaults.cameras.resize(1);
  std::set<std::string> default_lines;
  for (std::string& line : lines_of(core::toml_text(defaults)))
    if (!line.empty() && line[0] != '[') default_lines.insert(std::move(line));
  std::string text, head;  // a table's head waits for a line of its own
  for (const std::string& line : lines_of(core::toml_text(rig))) {
    const bool is_item = line.starts_with("[[");
    const bool is_head = line.starts_with('[') && !is_item;
    if (is_head || is_item) head = is_head ? line + '\n' : "";
    if (is_head || default_lines.contains(line) || (line.empty() && text.ends_with("\n\n")))
      continue;
    if (!line.empty()) text += std::exchange(head, {});
    text += line + '\n';
  }
  return text;
}

rigs::RigOptions rig_of_cameras(const std::string& name,
                                const std::vector<capture::CameraCalibration>& cameras) {
  rigs::RigOptions rig;
  rig.name = name;
  for (const capture::CameraCalibration& known : cameras) {
    // A rig file's 0 would say that the focal length is not stated, or that fy is fx.
    const std::vector<double>& p = known.intrinsics.parameters;
    if (!(p.at(0) > 0.0 && p.at(1) > 0.0))
      core::fail(core::ErrorKind::Config,
                 "camera {}: focal lengths of {} and {} px; both have to be above 0", known.name,
                 p[0], p[1]);
    rigs::CameraOptions& camera = rig.cameras.emplace_back();
    camera.name = known.name;
    camera.set_intrinsics(known.intrinsics);
    camera.set_pose(known.rig_from_camera);
  }
  return rig;
}

std::pair<std::string, std::string> names_of_topic(std::string topic) {
  for (const std::string_view ending : {"/compressed", "/compressedDepth"})
    if (topic.ends_with(ending)) topic.resize(topic.size() - ending.size());
  for (const std::string_view ending : {"/image_raw", "/image_rect", "/image_mono", "/image_color",
                                        "/image_rect_raw", "/image_rect_color", "/image"})
    if (topic.ends_with(ending)) topic.resize(topic.size() - ending.size());
  while (topic.starts_with('/')) topic.erase(0, 1);
  while (topic.ends_with('/')) topic.pop_back();
  if (topic.empty()) return {"", ""};
  const std::size_t slash = topic.rfind('/');
  if (slash == std::string::npos) return {"", safe_name(topic)};
  return {safe_name(topic.substr(0, slash)), safe_name(topic.substr(slash + 1))};
}

void name_apart(std::vector<capture::CameraCalibration>& cameras,
                const std::vector<std::string>& others) {
  std::set<std::string> names;
  for (const capture::CameraCalibration& camera : cameras) names.insert(camera.name);
  if (names.size() == cameras.size() && !names.contains("")) return;
  for (std::size_t i = 0; i < cameras.size(); ++i) cameras[i].name = safe_name(others.at(i));
}

geo::Rigid3d rig_from_rdf() {
  return {.rotation = Eigen::Quaterniond(geo::rig_from_rdf()).normalized(),
          .translation = Eigen::Vector3d::Zero()};
}

geo::CameraIntrinsics as_opencv(geo::CameraIntrinsics intrinsics) {
  if (intrinsics.model != "simple_radial" && intrinsics.model != "radial") return intrinsics;
  constexpr std::size_t kParameters = 8;  // fx fy cx cy k1 k2 p1 p2
  intrinsics.model = "opencv";
  intrinsics.parameters.resize(kParameters, 0.0);
  return intrinsics;
}

std::string safe_name(const std::string& text) {
  std::string name = text.substr(0, 64);
  for (char& letter : name)
    if (!capture::is_safe_name(std::string(1, letter))) letter = '_';
  return name.empty() ? "rig" : name;
}

}  // namespace terracast::rigs
