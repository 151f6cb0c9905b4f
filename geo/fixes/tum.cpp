#include <array>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "geo/fixes/exact_time.h"
#include "geo/fixes/fix_format.h"
#include "geo/fixes/text.h"
#include "geo/fixes/times.h"

namespace terracast::geo {
namespace {

using core::ErrorKind;
using core::fail;

constexpr std::size_t kNumFields = 8;
constexpr std::array<std::string_view, kNumFields> kFields = {"timestamp", "tx", "ty", "tz",
                                                              "qx",        "qy", "qz", "qw"};

constexpr std::array kKnown = {core::KnownName{"timestamp", "time in seconds"},
                               core::KnownName{"tx", "place in metres"},
                               core::KnownName{"ty", "place in metres"},
                               core::KnownName{"tz", "place in metres"},
                               core::KnownName{"qx", "attitude"},
                               core::KnownName{"qy", "attitude"},
                               core::KnownName{"qz", "attitude"},
                               core::KnownName{"qw", "attitude"},
                               core::KnownName{"# comments", "notes of the writer", false}};
constexpr std::array kTables = {core::KnownTable{"tum", "fields of a line", kKnown}};

/// TUM's trajectories: a line "timestamp tx ty tz qx qy qz qw" for each pose, the rotation from the
/// camera or body to the file's x, y, z; # begins a comment.
class TumFixes final : public FixFormat {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("attitude_axes", attitude_axes_,
              "The axes that the quaternions turn: right down forward (a camera), forward left up, "
              "forward right down.",
              core::one_of({"rdf", "flu", "frd"}));
    visit.key("unix_times", unix_times_, "Times count from 1970 UTC, not from any zero.");
  }
  std::unique_ptr<FixFormat> clone() const override { return std::make_unique<TumFixes>(*this); }
  FixFrame frame() const override { return FixFrame::Local; }

  FixTable read(const std::filesystem::path& file, const std::string&) const override {
    const std::string text = text_of_recording(file);
    FixTable table;
    table.frame = FixFrame::Local;
    table.attitude_frame = AttitudeFrame::Local;
    NearZero near_zero;
    std::size_t line_number = 0;
    for (const std::string_view line : lines_of_text(text)) {
      ++line_number;
      if (line.find('#') != std::string_view::npos) table.ledger.count("# comments", kKnown);
      const std::string_view content = trimmed(line.substr(0, line.find('#')));
      if (content.empty()) continue;
      if (table.fixes.size() >= kMostFixes)
        fail(ErrorKind::Input, "{}: more than {} poses", file.string(), kMostFixes);
      table.fixes.push_back(fix_of(content, fmt::format("{}, line {}", file.string(), line_number),
                                   near_zero, table));
      table.fixes.back().line = line_number;
    }
    if (unix_times_) table.zero_unix_s = near_zero.zero_s();
    const auto num_poses = static_cast<std::int64_t>(table.fixes.size());
    for (const std::string_view field : kFields)
      if (num_poses > 0) table.ledger.count(field, kKnown, num_poses);
    return table;
  }

 private:
  /// Counts fields beyond the eight, and those that say nan: where a tracker was lost.
  Fix fix_of(std::string_view line, const std::string& where, NearZero& near_zero,
             FixTable& table) const {
    const std::vector<std::string_view> words = words_of(line);
    const std::array<double, kNumFields> values = values_of(line, words, where);
    for (std::size_t i = 0; i < kNumFields; ++i)
      if (std::isnan(values[i])) ++table.empty[std::string(kFields[i])];
    for (std::size_t i = kNumFields; i < words.size(); ++i)
      table.ledger.miss(fmt::format("field {}", i + 1));
    if (unix_times_ && !std::isnan(values[0]) && !is_unix_time(values[0]))
      fail(ErrorKind::Input,
           "{}: timestamp = {} is no time between 1900 and 2200 in seconds since 1970; times from "
           "another zero have unix_times = false",
           where, words[0].substr(0, 80));
    Fix fix;
    if (!std::isnan(values[0]))
      fix.time_s = near_zero.next_s(exact_time_of(words[0], 0).value_or(ExactTime::of(values[0])));
    fix.place = {values[1], values[2], values[3]};
    const Eigen::Quaterniond rotation(values[7], values[4], values[5], values[6]);
    if (!rotation.coeffs().allFinite()) return fix;
    constexpr double kNormTolerance = 0.01;
    if (std::abs(rotation.norm() - 1.0) > kNormTolerance)
      fail(ErrorKind::Input, "{}: the quaternion has length {:.4f}; rotations have 1", where,
           rotation.norm());
    fix.attitude = rotation.normalized() * axes_from_body(attitude_axes_);
    return fix;
  }

  static std::array<double, kNumFields> values_of(std::string_view line,
                                                  const std::vector<std::string_view>& words,
                                                  const std::string& where) {
    constexpr std::size_t kOfAMatrix = 12;
    std::array<double, kNumFields> values;
    values.fill(std::numeric_limits<double>::quiet_NaN());
    bool are_numbers = words.size() >= kNumFields && words.size() != kOfAMatrix;
    for (std::size_t i = 0; are_numbers && i < kNumFields; ++i) {
      if (in_lower_case(words[i]) == "nan") continue;
      const auto value = number_of(words[i]);
      are_numbers = value.has_value();
      if (value) values[i] = *value;
    }
    if (!are_numbers)
      fail(ErrorKind::Input,
           "{}: \"{}\" is no pose; eight numbers, timestamp tx ty tz qx qy qz qw, are expected{}",
           where, line.substr(0, 80),
           line.find(',') != std::string_view::npos ? "; format = \"csv\" reads tables with commas"
           : words.size() == kOfAMatrix             ? ", not the twelve of a matrix"
                                                    : "");
    return values;
  }

  std::string attitude_axes_ = "rdf";
  bool unix_times_ = false;
};

}  // namespace

FixFormatInfo tum_fixes() {
  return {.name = "tum",
          .summary = "TUM's poses, a line each, about an origin that the config names.",
          .make = [] { return std::unique_ptr<FixFormat>(new TumFixes); },
          .known = kTables};
}

}  // namespace terracast::geo
