#include <algorithm>
#include <cmath>

#include "core/atomic_file.h"
#include "core/error.h"
#include "geo/fixes/fix_format.h"
#include "geo/fixes/text.h"

namespace terracast::geo {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;

/// KITTI raw's folder `oxts`: timestamps.txt, a time a line, and data/NNNNNNNNNN.txt, a packet of 30
/// numbers each. Heights are ellipsoidal; roll, pitch, yaw turn forward-left-up into the
/// east-north-up of the place, yaw anticlockwise from east.
class OxtsFixes final : public FixFormat {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("utc_offset_h", utc_offset_h_, "Hours by which timestamps.txt is ahead of UTC.",
              core::between(-14.0, 14.0));
  }
  std::unique_ptr<FixFormat> clone() const override { return std::make_unique<OxtsFixes>(*this); }
  std::string heights_above() const override { return "ellipsoid"; }

  FixTable read(const fs::path& folder, const std::string&) const override {
    const fs::path times_file = folder / "timestamps.txt";
    constexpr std::size_t kMostBytes = std::size_t{1} << 28;
    const std::string times_text = core::read_text_file(times_file, kMostBytes);
    const std::vector<std::string_view> times = lines_of_text(times_text);
    const std::vector<fs::path> packets = packets_of(folder / "data");
    if (times.size() != packets.size())
      fail(ErrorKind::Input,
           "{} holds {} times and {} holds {} packets; there is to be one time a packet",
           times_file.string(), times.size(), (folder / "data").string(), packets.size());
    FixTable table;
    table.has_utc = true;
    for (std::size_t i = 0; i < packets.size(); ++i) {
      Fix fix = fix_of(packets[i]);
      fix.time_s = unix_seconds_from_text(times[i], utc_offset_h_,
                                          fmt::format("{}, line {}", times_file.string(), i + 1));
      table.fixes.push_back(std::move(fix));
    }
    return table;
  }

 private:
  static std::vector<fs::path> packets_of(const fs::path& folder) {
    std::error_code error;
    std::vector<fs::path> packets;
    for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
         entry.increment(error)) {
      if (entry->path().extension() != ".txt") continue;
      packets.push_back(entry->path());
      if (packets.size() > kMostFixes)
        fail(ErrorKind::Input, "{}: more than {} packets", folder.string(), kMostFixes);
    }
    if (error)
      fail(ErrorKind::Io, "{}: {}; the folder oxts of a KITTI drive holds timestamps.txt and data/",
           folder.string(), error.message());
    std::sort(packets.begin(), packets.end());
    return packets;
  }

  static Fix fix_of(const fs::path& file) {
    constexpr std::size_t kMostBytes = 65536, kNumFields = 30;
    const std::string text = core::read_text_file(file, kMostBytes);
    const std::vector<std::string_view> words = words_of(text);
    if (words.size() != kNumFields)
      fail(ErrorKind::Input, "{}: {} numbers; a packet has {}", file.string(), words.size(),
           kNumFields);
    double values[kNumFields];
    for (std::size_t i = 0; i < kNumFields; ++i) {
      const auto value = number_of(words[i]);
      if (!value)
        fail(ErrorKind::Input, "{}: field {}, \"{}\", is no number", file.string(), i + 1,
             words[i].substr(0, 40));
      values[i] = *value;
    }
    Fix fix;
    fix.place = {values[0], values[1], values[2]};
    fix.attitude = rotation_by_angles(values[5], values[4], values[3]);
    fix.speed_mps = std::hypot(values[6], values[7]);
    return fix;
  }

  double utc_offset_h_ = 0.0;
};

}  // namespace

FixFormatInfo oxts_fixes() {
  return {.name = "oxts", .summary = "The folder oxts of a KITTI raw drive.", .make = [] {
            return std::unique_ptr<FixFormat>(new OxtsFixes);
          }};
}

}  // namespace terracast::geo
