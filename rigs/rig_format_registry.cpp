#include <algorithm>
#include <array>
#include <fstream>
#include <map>
#include <set>

#include "core/error.h"
#include "core/registry.h"
#include "core/schema_writer.h"
#include "rigs/rig_format.h"

// Every format, in alphabetical order: X(name) is rigs/formats/name.cpp, which defines
// `RigFormatInfo name_rigs()`.
#define TERRACAST_RIG_FORMATS(X) \
  X(carla)                       \
  X(colmap) X(csv) X(kalibr) X(opencv) X(orb_slam) X(ouster) X(ros) X(velodyne) X(vins) X(xlsx)

namespace terracast::rigs {

#define TERRACAST_DECLARE(name) RigFormatInfo name##_rigs();
TERRACAST_RIG_FORMATS(TERRACAST_DECLARE)
#undef TERRACAST_DECLARE

namespace {

/// Of a camera, what is neither its model, its lens nor its place on the rig.
constexpr std::array<std::string_view, 5> kShutterAndPupil = {"exposure_ms", "line_time_us",
                                                              "readout", "aperture_mm", "focus_m"};

/// Whether a key of a rig is held by tables alone.
bool is_of_tables(std::string_view key) {
  return key.starts_with("mount_") || key.starts_with("errors.") || key.starts_with("imaging.");
}

/// The keys whose values are not those of a fresh struct.
template <class Struct>
std::vector<std::string> stated_keys(const Struct& value) {
  std::map<std::string, std::string> defaults;
  for (const core::KeyInfo& key : core::list_keys(Struct{})) defaults[key.name] = key.default_value;
  std::vector<std::string> stated;
  for (const core::KeyInfo& key : core::list_keys(value))
    if (const auto found = defaults.find(key.name);
        found == defaults.end() || found->second != key.default_value)
      stated.push_back(key.name);
  return stated;
}

}  // namespace

std::vector<std::string> keys_left_out(const RigFormatInfo& format, const rigs::RigOptions& rig) {
  std::vector<std::string> left_out;
  if (!rig.sensors.empty()) left_out.emplace_back("sensors");
  if (format.is_table) return left_out;
  for (std::string& key : stated_keys(rig))
    if (is_of_tables(key)) left_out.push_back(std::move(key));
  for (const std::string_view wanted : kShutterAndPupil)
    if (std::any_of(rig.cameras.begin(), rig.cameras.end(), [&](const auto& camera) {
          const std::vector<std::string> stated = stated_keys(camera);
          return std::find(stated.begin(), stated.end(), wanted) != stated.end();
        }))
      left_out.push_back(fmt::format("cameras[].{}", wanted));
  return left_out;
}

std::span<const RigFormatInfo> rig_formats() {
#define TERRACAST_ENTRY(name) name##_rigs(),
  static const std::array table = {TERRACAST_RIG_FORMATS(TERRACAST_ENTRY)};
#undef TERRACAST_ENTRY
  return table;
}

std::vector<core::KnownTable> known_names_of_rigs() {
  std::vector<core::KnownTable> tables;
  for (const RigFormatInfo& format : rig_formats())
    for (const core::KnownTable& table : format.known()) tables.push_back(table);
  return tables;
}

std::vector<std::string> lines_not_used(const core::Ledger& ledger) {
  constexpr std::size_t kMostNames = 40;  // of a reason
  std::map<std::string, std::vector<std::string>> names_by_reason;
  for (const auto& [name, entry] : ledger.entries())
    if (entry.num_ignored > 0) names_by_reason[entry.why].push_back(name);
  std::vector<std::string> lines = ledger.warnings();
  for (auto& [why, names] : names_by_reason) {
    const std::size_t num_more = names.size() - std::min(names.size(), kMostNames);
    names.resize(names.size() - num_more);
    lines.push_back(fmt::format("not used: {}{} ({})", fmt::join(names, ", "),
                                num_more > 0 ? fmt::format(" and {} more", num_more) : "", why));
  }
  return lines;
}

void add_sensors(const rigs::RigOptions& from, rigs::RigOptions& onto) {
  std::set<std::string> names;
  for (const sensors::SensorOptions& sensor : onto.sensors) names.insert(sensor.name);
  for (const CameraOptions& camera : onto.placed_cameras()) names.insert(camera.name);
  // Angles turn a sensor from FLU whatever the axes; only its place is along them.
  const Eigen::Matrix3d onto_from_from = onto.rig_from_file().transpose() * from.rig_from_file();
  for (sensors::SensorOptions sensor : from.sensors) {
    const std::string stated = sensor.name;
    for (int number = 2; !names.insert(sensor.name).second; ++number)
      sensor.name = fmt::format("{}_{}", stated, number);
    if (onto.axes != from.axes && !sensor.offset_mm.empty()) {
      const Eigen::Vector3d offset_mm =
          onto_from_from *
          Eigen::Vector3d(sensor.offset_mm[0], sensor.offset_mm[1], sensor.offset_mm[2]);
      sensor.offset_mm = {offset_mm.x(), offset_mm.y(), offset_mm.z()};
    }
    onto.sensors.push_back(std::move(sensor));
  }
  onto.validate();
}

ImportedRig import_rig(const RigFormatInfo& format, const std::filesystem::path& path,
                       const ReadOptions& options) {
  try {
    ImportedRig read = format.read(path, options);
    if (!format.is_of_sensors) build_cameras({read.rig});
    return read;
  } catch (const core::Error& error) {
    if (error.kind() != core::ErrorKind::Config) throw;
    core::fail(core::ErrorKind::Input, "{}: no rig can be made of it: {}", path.string(),
               error.message());
  }
}

const RigFormatInfo& find_rig_format(const std::filesystem::path& path) {
  if (!std::filesystem::exists(path))
    core::fail(core::ErrorKind::Io, "{}: no such file or folder", path.string());
  std::string first_bytes(256, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(first_bytes.data(), static_cast<std::streamsize>(first_bytes.size()));
  first_bytes.resize(static_cast<std::size_t>(std::max<std::streamsize>(file.gcount(), 0)));
  for (const RigFormatInfo& format : rig_formats())
    if (format.recognises(path, first_bytes)) return format;
  core::fail(core::ErrorKind::Input,
             "{}: neither its name nor its keys tell a format of rigs; give --format, one of {}",
             path.string(), fmt::join(core::registry_names(rig_formats()), ", "));
}

}  // namespace terracast::rigs
