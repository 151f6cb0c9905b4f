#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "rigs/rig.h"

/// Rigs as files of other programs, and as pictures.
namespace terracast::rigs {

/// What a file of a rig may leave open.
struct ReadOptions {
  std::string name;  ///< of the rig; empty: the file's own, or of the file
  std::string
      axes;  ///< of offsets and rotations in tables that do not say: flu, rdf; empty: refuse
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
  /// Whether a path is meant for the format, from its name and its first bytes.
  bool (*recognises)(const std::filesystem::path& path, std::string_view first_bytes);
  rigs::RigOptions (*read)(const std::filesystem::path& path, const ReadOptions& options);
  void (*write)(const rigs::RigOptions& rig, const std::filesystem::path& path);
};

/// The keys that a rig states and a format does not hold, as a rig file calls them ("mount_pitch_deg",
/// "cameras[].exposure_ms", "errors.focal_length_sd_px"), in the order of config.md. Tables hold all.
/// What is left out changes no camera's model, lens or place on the rig.
std::vector<std::string> keys_left_out(const RigFormatInfo& format, const rigs::RigOptions& rig);

/// The table of formats.
std::span<const RigFormatInfo> rig_formats();

/// The format of a file or folder that is there.
/// throws   Input: none takes it
const RigFormatInfo& find_rig_format(const std::filesystem::path& path);

}  // namespace terracast::rigs
