#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "core/schema.h"
#include "geo/fixes/fix.h"

namespace terracast::geo {

/// How one format of recordings is read: the derived class describes its keys.
class FixFormat {
 public:
  virtual ~FixFormat() = default;
  virtual void describe(core::SchemaVisitor&) {}
  /// throws Config: options that contradict each other
  virtual void validate() const {}
  virtual std::unique_ptr<FixFormat> clone() const = 0;

  virtual FixFrame frame() const { return FixFrame::Geodetic; }
  /// What the format's own definition says that heights are above; empty: nothing.
  virtual std::string heights_above() const { return ""; }

  /// file    what the format calls a recording: a file or folder
  /// above   what the config says that heights are above (see HeightOptions); of formats that hold
  ///         several heights it chooses
  ///         "none": heights are not read
  /// throws  Io: no such file; Input: it is not of this format, with the line
  ///         Config: it states no heights such as above asks for
  virtual FixTable read(const std::filesystem::path& file, const std::string& above) const = 0;
};

struct FixFormatInfo {
  std::string_view name;
  std::string_view summary;
  std::unique_ptr<FixFormat> (*make)();
  /// What its reader makes of the names that such files hold, as it counts them in FixTable::ledger.
  std::span<const core::KnownTable> known;
};

/// The way out where a recording has no heights, for messages.
inline constexpr std::string_view kNoHeightsWayOut =
    "above = \"none\" asks the file for no height, and flies it height_offset_m above the ground";

/// Why heights are ignored, for ledgers.
inline constexpr std::string_view kNoHeightsWanted = "above = \"none\" asks for no heights";

/// The table of formats: adsb, csv, euroc, gpx, jsbsim, oxts, sbet, srt, tum, ulog.
std::span<const FixFormatInfo> fix_formats();

}  // namespace terracast::geo
