#include <algorithm>
#include <array>
#include <cmath>

#include "core/atomic_file.h"
#include "core/error.h"
#include "geo/fixes/fix_format.h"
#include "geo/fixes/text.h"
#include "geo/fixes/times.h"

namespace terracast::geo {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;

constexpr std::size_t kNumFields = 30;
constexpr std::array<std::string_view, kNumFields> kFields = {
    "lat",          "lon",     "alt",     "roll",    "pitch",   "yaw",    "vn", "ve",
    "vf",           "vl",      "vu",      "ax",      "ay",      "az",     "af", "al",
    "au",           "wx",      "wy",      "wz",      "wf",      "wl",     "wu", "pos_accuracy",
    "vel_accuracy", "navstat", "numsats", "posmode", "velmode", "orimode"};

constexpr std::string_view kOfTheMotion = "follows from the places and attitudes that are flown";
constexpr std::string_view kOfQuality = "how good the fix is; sigma_m says that of all";

// By dataformat.txt, which each such folder holds.
constexpr std::array kKnown = {
    core::KnownName{"lat", "latitude in degrees"},
    core::KnownName{"lon", "longitude in degrees"},
    core::KnownName{"alt", "height above the ellipsoid in metres"},
    core::KnownName{"roll", "attitude"},
    core::KnownName{"pitch", "attitude"},
    core::KnownName{"yaw", "attitude"},
    core::KnownName{"vn", "speed over ground, which the motion is compared with"},
    core::KnownName{"ve", "speed over ground, which the motion is compared with"},
    core::KnownName{"timestamps.txt", "times"},
    core::KnownName{"vf", kOfTheMotion, false},
    core::KnownName{"vl", kOfTheMotion, false},
    core::KnownName{"vu", kOfTheMotion, false},
    core::KnownName{"ax", kOfTheMotion, false},
    core::KnownName{"ay", kOfTheMotion, false},
    core::KnownName{"az", kOfTheMotion, false},
    core::KnownName{"af", kOfTheMotion, false},
    core::KnownName{"al", kOfTheMotion, false},
    core::KnownName{"au", kOfTheMotion, false},
    core::KnownName{"wx", kOfTheMotion, false},
    core::KnownName{"wy", kOfTheMotion, false},
    core::KnownName{"wz", kOfTheMotion, false},
    core::KnownName{"wf", kOfTheMotion, false},
    core::KnownName{"wl", kOfTheMotion, false},
    core::KnownName{"wu", kOfTheMotion, false},
    core::KnownName{"pos_accuracy", kOfQuality, false},
    core::KnownName{"vel_accuracy", kOfQuality, false},
    core::KnownName{"navstat", kOfQuality, false},
    core::KnownName{"numsats", kOfQuality, false},
    core::KnownName{"posmode", kOfQuality, false},
    core::KnownName{"velmode", kOfQuality, false},
    core::KnownName{"orimode", kOfQuality, false},
    core::KnownName{"dataformat.txt", "what the fields mean, which is known", false}};
constexpr std::array kTables = {core::KnownTable{"oxts", "fields of a packet, and files", kKnown}};

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
    const std::string times_text = text_of_recording(times_file);
    std::vector<std::string_view> times = lines_of_text(times_text);
    while (!times.empty() && trimmed(times.back()).empty()) times.pop_back();
    FixTable table;
    count_files(folder, table.ledger);
    const std::vector<fs::path> packets = packets_of(folder / "data", table.ledger);
    if (times.size() != packets.size())
      fail(ErrorKind::Input,
           "{} holds {} times and {} holds {} packets; there is to be one time a packet",
           times_file.string(), times.size(), (folder / "data").string(), packets.size());
    NearZero near_zero;
    for (std::size_t i = 0; i < packets.size(); ++i) {
      Fix fix = fix_of(packets[i], table.ledger);
      const auto time = stated_time(times[i], utc_offset_h_);
      if (!time)
        unix_seconds_from_text(times[i], utc_offset_h_,  // says why not
                               fmt::format("{}, line {}", times_file.string(), i + 1));
      fix.time_s = near_zero.next_s(time->exact);
      table.fixes.push_back(std::move(fix));
    }
    table.zero_unix_s = near_zero.zero_s();
    if (utc_offset_h_ == 0.0 && !table.fixes.empty())
      table.remarks.push_back(
          "times state no zone; they are taken to be UTC, and utc_offset_h would say otherwise");
    return table;
  }

 private:
  /// Of the folder itself.
  static void count_files(const fs::path& folder, core::Ledger& ledger) {
    std::error_code error;
    for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
         entry.increment(error))
      if (entry->path().filename() != "data")
        ledger.count(entry->path().filename().string(), kKnown);
  }

  static std::vector<fs::path> packets_of(const fs::path& folder, core::Ledger& ledger) {
    std::error_code error;
    std::vector<fs::path> packets;
    for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
         entry.increment(error)) {
      if (entry->path().extension() != ".txt") {
        ledger.miss(fmt::format("data/*{}", entry->path().extension().string()));
        continue;
      }
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

  static Fix fix_of(const fs::path& file, core::Ledger& ledger) {
    constexpr std::size_t kMostBytes = 65536;
    const std::string text = core::read_text_file(file, kMostBytes);
    const std::vector<std::string_view> words = words_of(text);
    if (words.size() < kNumFields)
      fail(ErrorKind::Input, "{}: {} numbers; a packet has {}", file.string(), words.size(),
           kNumFields);
    for (std::size_t i = 0; i < words.size(); ++i) {
      if (i < kNumFields)
        ledger.count(kFields[i], kKnown);
      else
        ledger.miss(fmt::format("field {}", i + 1));
    }
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
  return {.name = "oxts",
          .summary = "The folder oxts of a KITTI raw drive.",
          .make = [] { return std::unique_ptr<FixFormat>(new OxtsFixes); },
          .known = kTables};
}

}  // namespace terracast::geo
