#include "validate/moving.h"

#include <fmt/format.h>

#include <cmath>

#include "core/atomic_file.h"
#include "validate/dataset.h"
#include "validate/text.h"

namespace terracast::validate {

namespace {

using core::ErrorKind;
using core::fail;
using core::Json;

constexpr std::size_t kMostBodies = 0xffff;
constexpr std::string_view kHeader =
    "frame,body,x_m,y_m,z_m,qw,qx,qy,qz,vx_mps,vy_mps,vz_mps,ax_mps2,ay_mps2,az_mps2,wx_radps,wy_"
    "radps,wz_radps";

std::string safe_path(const Json& json, const char* name) {
  const std::string path = json.at(name).string();
  if (!is_safe_relative_path(path))
    fail(ErrorKind::Input, "dataset.json: the path \"{}\" leaves the dataset", path);
  return path;
}

MovingBody read_body(const Json& json) {
  MovingBody body;
  const auto text = [&](const char* member) {
    return json.has(member) ? json.at(member).string() : std::string();
  };
  body.thing = text("thing");
  body.class_name = text("class");
  body.part_of = text("part_of");
  if (json.has("instance_id")) body.instance_id = json.at("instance_id").integer();
  if (!json.has("lowest_m")) return body;
  const std::vector<double> lowest = json.at("lowest_m").numbers();
  const std::vector<double> highest = json.at("highest_m").numbers();
  if (lowest.size() != 3 || highest.size() != 3)
    fail(ErrorKind::Input, "dataset.json: moving: a box of {} and {} numbers, not of 3",
         lowest.size(), highest.size());
  body.box_m = {Eigen::Vector3d(lowest[0], lowest[1], lowest[2]),
                Eigen::Vector3d(highest[0], highest[1], highest[2])};
  if (body.box_m.isEmpty())
    fail(ErrorKind::Input, "dataset.json: moving: lowest_m is not below highest_m");
  return body;
}

void read_states(const Dataset& dataset, const std::string& path, Moving& moving) {
  const std::string text = core::read_text_file(dataset.root / path);
  const std::vector<TextLine> lines = split_lines(text);
  const std::string with_terms = fmt::format("{},{}", kHeader, kTermColumns);
  const bool has_terms = !lines.empty() && lines[0].text == with_terms;
  if (!has_terms && (lines.empty() || lines[0].text != kHeader))
    fail(ErrorKind::Input, "{}:1: another header than {}", path, with_terms);
  const std::size_t num_columns = has_terms ? 18 + kNumTermColumns : 18;
  for (std::size_t i = 1; i < lines.size(); ++i) {
    const std::string where = path + ":" + std::to_string(lines[i].number);
    const std::vector<std::string_view> parts = split_at(lines[i].text, ',');
    if (parts.size() != num_columns)
      fail(ErrorKind::Input, "{}: {} columns, not {}", where, parts.size(), num_columns);
    const std::int64_t frame = parse_integer(parts[0], where);
    const std::int64_t body = parse_integer(parts[1], where);
    if (frame < 0 || frame >= static_cast<std::int64_t>(moving.states.size()))
      fail(ErrorKind::Input, "{}: frame {} is not in the dataset", where, frame);
    if (body < 1 || body > static_cast<std::int64_t>(moving.names.size()))
      fail(ErrorKind::Input, "{}: there is no body {}", where, body);
    std::optional<MovingState>& state =
        moving.states[static_cast<std::size_t>(frame)][static_cast<std::size_t>(body - 1)];
    if (state) fail(ErrorKind::Input, "{}: body {} of frame {} stands twice", where, body, frame);
    std::vector<double> n;
    for (std::size_t k = 2; k < num_columns; ++k) n.push_back(parse_number(parts[k], where));
    const Eigen::Quaterniond rotation(n[3], n[4], n[5], n[6]);
    constexpr double kUnit = 1e-9;
    if (!(std::abs(rotation.norm() - 1.0) <= kUnit))
      fail(ErrorKind::Input, "{}: the rotation's length is {}, not 1", where, rotation.norm());
    state =
        MovingState{.local_from_body = {rotation.toRotationMatrix(), {n[0], n[1], n[2]}},
                    .motion = {{n[7], n[8], n[9]}, {n[10], n[11], n[12]}, {n[13], n[14], n[15]}}};
    if (has_terms) set_terms(&n[16], where, state->motion);
  }
}

}  // namespace

const MovingState* Moving::state(int frame, int body) const {
  if (frame < 0 || body < 1 || frame >= static_cast<int>(states.size()) ||
      body > static_cast<int>(names.size()))
    return nullptr;
  const auto& state = states[static_cast<std::size_t>(frame)][static_cast<std::size_t>(body - 1)];
  return state ? &*state : nullptr;
}

Moving read_moving(const Dataset& dataset, const Json& json, int num_frames, Findings& findings) {
  Moving moving;
  moving.masks = safe_path(json, "masks");
  const Json& bodies = json.at("bodies");
  if (!bodies.is_array() || bodies.size() < 1 || bodies.size() > kMostBodies)
    fail(ErrorKind::Input, "dataset.json: moving: bodies must be a list of 1 to {}", kMostBodies);
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    moving.names.push_back(bodies.at(i).at("name").string());
    moving.bodies.push_back(read_body(bodies.at(i)));
  }
  moving.states.assign(static_cast<std::size_t>(num_frames),
                       std::vector<std::optional<MovingState>>(moving.names.size()));
  const std::string path = safe_path(json, "states");
  findings.attempt(path, [&] { read_states(dataset, path, moving); });
  return moving;
}

}  // namespace terracast::validate
