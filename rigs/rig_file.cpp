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
    rigs::CameraOptions& camera = rig.cameras.emplace_back();
    camera.name = known.name;
    camera.set_intrinsics(known.intrinsics);
    camera.set_pose(known.rig_from_camera);
  }
  return rig;
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
