#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/ledger.h"
#include "rigs/rig.h"

/// Rigs as files of other programs, and as pictures.
namespace terracast::rigs {

/// What a file of a rig may leave open.
struct ReadOptions {
  std::string name;  ///< of the rig; empty: the file's own, or of the file
  std::string
      axes;  ///< of offsets and rotations in tables that do not say: flu, rdf; empty: refuse
  double imu_rate_hz =
      0.0;  ///< of files that state an IMU's noise by its samples, without their rate; 0: not known
};

/// A rig from another program's file, and what became of all that the file says.
struct ImportedRig {
  rigs::RigOptions rig;
  core::Ledger ledger;
};

/// A format that rigs are read from and written in.
///
/// read     throws Io: no such file; Input: damaged, hostile, not of this format, not a rig; says where, and
///          what would be right
/// write    throws Config: the format cannot hold the rig, which is the case with models that it does not know
/// accuracy what was written reads back to the same cameras: positions to 1e-12 m, rotations to 1e-12 rad,
///          optics to 1e-9 px; RigFormats.GiveEachRigBack
struct RigFormatInfo {
  std::string_view name;
  std::string_view summary;
  bool is_table = false;  ///< whose axes may be left open
  bool is_of_sensors =
      false;  ///< of sensors alone, without a camera, which are added to another rig
  /// Whether a path is meant for the format, from its name and its first bytes.
  bool (*recognises)(const std::filesystem::path& path, std::string_view first_bytes);
  ImportedRig (*read)(const std::filesystem::path& path, const ReadOptions& options);
  /// nullptr: a format that is only read.
  void (*write)(const rigs::RigOptions& rig, const std::filesystem::path& path) = nullptr;
  /// The keys, members and columns that it knows.
  std::vector<core::KnownTable> (*known)() = nullptr;
};

/// The tables of all formats, in the order of their names.
std::vector<core::KnownTable> known_names_of_rigs();

/// What a file says that its rig does not: a line for each reason why names are ignored, and for each name that is not
/// known or whose value was not understood.
std::vector<std::string> lines_not_used(const core::Ledger& ledger);

/// The keys that a rig states and a format does not hold, as a rig file calls them ("mount_pitch_deg",
/// "cameras[].exposure_ms", "errors.focal_length_sd_px"), in the order of config.md. Tables hold all.
/// What is left out changes no camera's model, lens or place on the rig.
std::vector<std::string> keys_left_out(const RigFormatInfo& format, const rigs::RigOptions& rig);

/// The table of formats.
std::span<const RigFormatInfo> rig_formats();

/// Adds sensors to a rig; those whose names are taken get a number: lidar_2. The
/// two rigs' origins and forward directions become one, whatever axes each counts in.
/// throws   Config: what rigs refuse
void add_sensors(const rigs::RigOptions& from, rigs::RigOptions& onto);

/// Reads a file's rig, of which a sequence can be made; of a format of sensors, once they are added to a rig with a camera.
/// throws   as RigFormatInfo::read; Input: cameras of no model's range, names that repeat
ImportedRig import_rig(const RigFormatInfo& format, const std::filesystem::path& path,
                       const ReadOptions& options);

/// The format of a file or folder.
/// throws   Io: it is not there; Input: no format takes it
const RigFormatInfo& find_rig_format(const std::filesystem::path& path);

}  // namespace terracast::rigs
