#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/json.h"
#include "validate/checks/checker.h"
#include "validate/checks/contradictions.h"
#include "validate/pictures.h"
#include "validate/readers/sensors.h"
#include "validate/text.h"

/// Events of event cameras: what their rows say of each other, and against the images of the camera whose lens they share.
namespace terracast::validate {

namespace {

/// Columns of a row, after its time.
enum Column : std::size_t { kX = 1, kY, kPolarity, kIsNoise, kContrast };

struct Event {
  double time_s = 0.0;
  std::size_t pixel = 0;
  bool is_on = false;
  bool is_noise = false;
  double contrast = 0.0;
};

/// Linear light of an image's level, of the film's straight part; nothing above its knee and next to black, where a level
/// is a large share of the light.
std::optional<double> linear_of(int level) {
  constexpr int kLeast = 8;
  constexpr int kKnee = 187;  // half of white by sRGB's curve
  if (level < kLeast || level > kKnee) return std::nullopt;
  const double value = level / 255.0;
  return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

/// ln of a pixel's luminance, and by how much the rounding of its levels may shift it.
struct LogLight {
  double value = 0.0;
  double rounding = 0.0;
};
std::optional<LogLight> log_light_of(const core::Image8& color, int x, int y) {
  constexpr std::array<double, 3> kLuminance = {0.2126, 0.7152, 0.0722};
  double light = 0.0, rounding = 0.0;
  for (int k = 0; k < 3; ++k) {
    const std::uint8_t level = color(x, y, k);
    const std::optional<double> here = linear_of(level), above = linear_of(level + 1);
    if (!here || !above) return std::nullopt;
    light += kLuminance[static_cast<std::size_t>(k)] * *here;
    rounding += 0.5 * kLuminance[static_cast<std::size_t>(k)] * (*above - *here);
  }
  return LogLight{.value = std::log(light), .rounding = rounding / light};
}

/// Height of the sun above the horizon, to 5 deg: by the day of the year and the hour, without the equation of time. NaN where
/// no time is stated.
double sun_deg(const Sequence& sequence) {
  try {
    const double unix_s = 1e-9 * static_cast<double>(parse_utc_ns(sequence.utc_start, "utc_start"));
    constexpr double kDay_s = 86400.0, kYear_days = 365.2425, kTilt_deg = 23.44;
    const double days_since_solstice = std::fmod(unix_s / kDay_s + 10.0, kYear_days);
    const double declination = -radians_from_degrees(kTilt_deg) *
                               std::cos(2.0 * std::numbers::pi * days_since_solstice / kYear_days);
    const double hour_angle = 2.0 * std::numbers::pi * (std::fmod(unix_s, kDay_s) / kDay_s - 0.5) +
                              radians_from_degrees(sequence.origin.lon_deg);
    const double latitude = radians_from_degrees(sequence.origin.lat_deg);
    return degrees_from_radians(
        std::asin(std::sin(latitude) * std::sin(declination) +
                  std::cos(latitude) * std::cos(declination) * std::cos(hour_angle)));
  } catch (const core::Error& error) {
    if (error.kind() != core::ErrorKind::Input) throw;
    return std::numeric_limits<double>::quiet_NaN();
  }
}

/// One event camera of a sequence.
class EventStream {
 public:
  EventStream(SensorRecord sensor, const Sequence& sequence)
      : sensor_(std::move(sensor)), settings_(event_settings(sensor_)), sequence_(sequence) {
    width_px_ = settings_.width_px;
    height_px_ = settings_.height_px;
    for (std::size_t i = 0; i < sequence.cameras.size(); ++i) {
      const Camera& camera = sequence.cameras[i];
      if (settings_.camera.empty() || camera.rig != sensor_.rig ||
          camera.name_in_rig != settings_.camera)
        continue;
      camera_index_ = static_cast<int>(i);
      width_px_ = camera.intrinsics.width_px;
      height_px_ = camera.intrinsics.height_px;
    }
    is_size_known_ = width_px_ > 0 && height_px_ > 0;
    const std::size_t num_pixels =
        static_cast<std::size_t>(width_px_) * static_cast<std::size_t>(height_px_);
    contrasts_.assign(2 * num_pixels, std::numeric_limits<double>::quiet_NaN());
    last_s_.assign(num_pixels, -std::numeric_limits<double>::infinity());
  }

  const SensorRecord& sensor() const { return sensor_; }
  int camera_index() const { return camera_index_; }
  std::size_t num_events() const { return num_events_; }

  /// Reads a frame's scans, and adds what pixels gained to their sums.
  void read(const Dataset& dataset, int frame, FileContradictions& found) {
    const NpyTable table = read_scans(dataset, sensor_, frame);
    const std::string name = fmt::format("{}/{:06}.npy", sensor_.file, frame);
    // Scans begin from the frame's time to before the next one's, and the last one goes on.
    const double from_s = frame / sequence_.rate_hz;
    const double to_s = (frame + 1) / sequence_.rate_hz + 1.0 / sensor_.rate_hz;
    const bool is_shown = is_size_known_ && frame == sequence_.num_frames / 2;
    if (is_shown) counts_ = core::ImageF(width_px_, height_px_, 1);
    Event before{.time_s = -std::numeric_limits<double>::infinity()};
    for (std::size_t row = 0; row < table.num_rows; ++row) {
      const auto at = [&](std::size_t column) { return table.number(table.columns[column], row); };
      const auto where = [&] { return fmt::format("{}, row {}", name, row); };
      const double x = at(kX), y = at(kY), time_s = at(0);
      constexpr double kRounding_s = 1e-9;
      found.expect(time_s >= from_s - kRounding_s && time_s < to_s + kRounding_s, [&] {
        return fmt::format("{}: at {} s, and the frame's scans are from {} to {} s", where(),
                           time_s, from_s, to_s);
      });
      const double ns = time_s * 1e9;
      // A double of 1e4 s is known to 2e-3 ns.
      found.expect(std::abs(ns - std::round(ns)) < 0.01, [&] {
        return fmt::format("{}: {} s is no whole number of ns", where(), time_s);
      });
      // Of a camera that the format leaves out the size is not known: its pixels are not judged.
      const bool is_inside = x < width_px_ && y < height_px_;
      found.expect(is_inside || !is_size_known_, [&] {
        return fmt::format("{}: pixel ({}, {}) of {} x {}", where(), x, y, width_px_, height_px_);
      });
      found.expect(at(kPolarity) <= 1.0 && at(kIsNoise) <= 1.0, [&] {
        return fmt::format("{}: polarity {}, is_noise {}; both are 0 or 1", where(), at(kPolarity),
                           at(kIsNoise));
      });
      if (!is_inside || !std::isfinite(time_s)) continue;
      const Event event{.time_s = time_s,
                        .pixel = static_cast<std::size_t>(y) * static_cast<std::size_t>(width_px_) +
                                 static_cast<std::size_t>(x),
                        .is_on = at(kPolarity) == 1.0,
                        .is_noise = at(kIsNoise) == 1.0,
                        .contrast = at(kContrast)};
      found.expect(event.time_s > before.time_s ||
                       (event.time_s == before.time_s && event.pixel > before.pixel),
                   [&] { return fmt::format("{}: not behind the row before", where()); });
      compare_with_pixel(event, where, found);
      if (is_shown) counts_(static_cast<int>(x), static_cast<int>(y)) += event.is_on ? 1.0F : -1.0F;
      add(event);
      before = event;
      ++num_events_;
    }
  }

  /// The events of the middle frame's scans, pixel by pixel; nothing where the size is not known.
  std::optional<CheckResult::Picture> picture() const {
    if (counts_.empty()) return std::nullopt;
    constexpr float kFull = 3.0F;
    return CheckResult::Picture{
        .title = fmt::format("{}/{}: events of {:.3g} s, brighter red, darker blue", sensor_.rig,
                             sensor_.name, 1.0 / sequence_.rate_hz),
        .image = diverging_picture(counts_, kFull)};
  }

  /// Ends at a frame's time what pixels gained since the one before.
  std::vector<double> take_gains(int frame) {
    const double until_s = frame / sequence_.rate_hz;
    std::vector<double> gains(last_s_.size());
    std::size_t kept = 0;
    for (const Event& event : waiting_) {
      if (event.time_s <= until_s)
        gains[event.pixel] += event.is_on ? event.contrast : -event.contrast;
      else
        waiting_[kept++] = event;
    }
    waiting_.resize(kept);
    return gains;
  }

  /// By how much the references may be off the light at both ends.
  double slack() const {
    return settings_.contrast_on + settings_.contrast_off + 6.0 * settings_.contrast_sd;
  }

  /// Why sums of events from frame to frame are not the images' change of light; empty: they are.
  std::string why_not_light() const {
    // The low-pass runs after the light; how far it is behind depends on how fast texture moves.
    constexpr double kMostLag_frames = 0.02;
    const double frame_s = 1.0 / sequence_.rate_hz;
    if (settings_.cutoff_hz > 0.0) {
      const double lag_s =
          1.0 / (2.0 * std::numbers::pi * settings_.cutoff_hz * settings_.cutoff_least_share);
      if (!(lag_s <= kMostLag_frames * frame_s))
        return fmt::format("the low-pass may lag by {:.3g} s, and frames are {:.3g} s apart", lag_s,
                           frame_s);
    }
    constexpr double kMostLeak = 0.1;
    const double leak = settings_.leak_hz * settings_.contrast_on * frame_s;
    if (!(leak <= kMostLeak * slack()))
      return fmt::format("leaks add {:.3g} from frame to frame", leak);
    constexpr double kMostLost_frames = 0.002;
    if (settings_.are_changes_lost &&
        !(1e-6 * settings_.refractory_us <= kMostLost_frames * frame_s))
      return "changes within the refractory time are lost";
    // In daylight grey has some hundred cd/m2 and more, at a low sun under clouds some ten.
    constexpr double kMostDark_cd_per_m2 = 1.0, kLowestSun_deg = 10.0;
    if (settings_.dark_cd_per_m2 > kMostDark_cd_per_m2)
      return fmt::format("a dark current as of {:.3g} cd/m2", settings_.dark_cd_per_m2);
    if (settings_.dark_cd_per_m2 > 0.0 && !(sun_deg(sequence_) >= kLowestSun_deg))
      return "the sun is low, and dark current fades contrasts";
    return {};
  }

 private:
  template <class Where>
  void compare_with_pixel(const Event& event, const Where& where, FileContradictions& found) {
    double& own = contrasts_[2 * event.pixel + (event.is_on ? 1 : 0)];
    const double nominal = event.is_on ? settings_.contrast_on : settings_.contrast_off;
    // Seven deviations are drawn once in 1e11; float32 holds seven digits.
    found.expect(std::abs(event.contrast - nominal) <= 7.0 * settings_.contrast_sd + 1e-6 * nominal,
                 [&] {
                   return fmt::format("{}: a threshold of {}, and settings have {} +- {}", where(),
                                      event.contrast, nominal, settings_.contrast_sd);
                 });
    found.expect(std::isnan(own) || own == event.contrast, [&] {
      return fmt::format("{}: a threshold of {}, and the pixel's is {}", where(), event.contrast,
                         own);
    });
    own = event.contrast;
    // Both times are rounded down to the nanosecond.
    found.expect(event.time_s - last_s_[event.pixel] >= 1e-6 * settings_.refractory_us - 2e-9, [&] {
      return fmt::format("{}: {} us after the pixel's last event, in its refractory time of {} us",
                         where(), 1e6 * (event.time_s - last_s_[event.pixel]),
                         settings_.refractory_us);
    });
    last_s_[event.pixel] = event.time_s;
  }
  void add(const Event& event) {
    if (camera_index_ >= 0 && !event.is_noise) waiting_.push_back(event);
  }

  SensorRecord sensor_;
  EventSettings settings_;
  const Sequence& sequence_;
  int camera_index_ = -1;
  int width_px_ = 0;
  int height_px_ = 0;
  bool is_size_known_ = false;
  std::vector<double> contrasts_;  ///< of each pixel's signs; NaN: not seen yet
  std::vector<double> last_s_;     ///< of each pixel's events
  std::vector<Event> waiting_;     ///< that are not in any frame's gains
  std::size_t num_events_ = 0;
  core::ImageF counts_;  ///< of the middle frame's scans, brighter less darker
};

/// What events and images say of the same pixels from frame to frame.
struct LightComparison {
  std::vector<double> shares;  ///< of what is allowed, of pixels whose events say much
  std::string first;

  void compare(const EventStream& stream, const std::vector<double>& gains,
               const core::Image8& before, const core::Image8& after, int frame) {
    // Of these the sign is sure, and that a change is there.
    const double strong = 2.0 * stream.slack();
    for (std::size_t pixel = 0; pixel < gains.size(); ++pixel) {
      if (std::abs(gains[pixel]) < strong) continue;
      const int x = static_cast<int>(pixel % static_cast<std::size_t>(before.width()));
      const int y = static_cast<int>(pixel / static_cast<std::size_t>(before.width()));
      const auto was = log_light_of(before, x, y), is = log_light_of(after, x, y);
      if (!was || !is) continue;
      if (shares.empty())
        first = fmt::format("{}, from frame {} on, pixel ({}, {})", stream.sensor().file, frame - 1,
                            x, y);
      shares.push_back(std::abs(is->value - was->value - gains[pixel]) /
                       (stream.slack() + is->rounding + was->rounding));
    }
  }
};

class EventsChecker : public Checker {
 public:
  explicit EventsChecker(const ValidateOptions& /*options*/) {}

  void frame(const FrameWindow& window, const std::vector<ViewPair>& /*pairs*/) override {
    const Sequence& sequence = window.sequence();
    if (!is_open_) open(window.dataset(), sequence);
    for (EventStream& stream : streams_) {
      try {
        compare(window, stream);
      } catch (const core::Error& error) {
        if (error.kind() != core::ErrorKind::Input) throw;
        rows_.expect(false, "{}", error.what());
      }
    }
  }

  std::vector<CheckResult> finish(const Dataset& dataset, const Sequence& sequence) override {
    if (!is_open_) open(dataset, sequence);
    if (is_part_) return {};
    if (streams_.empty()) return {skipped_result("events", "there is no event camera")};
    CheckResult rows = rows_.result("events");
    std::size_t num_events = 0;
    for (const EventStream& stream : streams_) num_events += stream.num_events();
    rows.summary = fmt::format(
        "Rows of {} events of {} cameras: order, times, pixels, polarities, refractory time, one "
        "threshold a pixel and sign.",
        num_events, streams_.size());
    for (const EventStream& stream : streams_)
      if (std::optional<CheckResult::Picture> picture = stream.picture())
        rows.pictures.push_back(std::move(*picture));
    rows.reason = "They follow the sensor's own rules.";
    rows.detects = "times in another unit, x and y exchanged where the image is not square";
    return {rows, light()};
  }

 private:
  void open(const Dataset& dataset, const Sequence& sequence) {
    is_open_ = true;
    has_ideal_images_ = !dataset.files.contains(sequence.path + "/imaging.json") &&
                        are_taken_at_once(dataset, sequence);
    try {
      for (SensorRecord& sensor : read_sensors(dataset, sequence)) {
        if (sensor.kind != "events") continue;
        // Files of scans are those of the whole sequence, and go by its frames' numbers.
        if (dataset.files.contains(fmt::format("{}/{:06}.npy", sensor.file, sequence.num_frames)))
          is_part_ = true;
        else
          streams_.emplace_back(std::move(sensor), sequence);
      }
    } catch (const core::Error& error) {
      if (error.kind() != core::ErrorKind::Input && error.kind() != core::ErrorKind::Io) throw;
      streams_.clear();  // `sensors` names what is wrong
    }
  }

  /// Whether no image rolls, or is exposed for a time.
  static bool are_taken_at_once(const Dataset& dataset, const Sequence& sequence) {
    const core::Json json = core::Json::read(dataset.root / "dataset.json");
    const core::Json& sequences = json.at("sequences");
    for (std::size_t i = 0; i < sequences.size(); ++i) {
      if (sequences.at(i).at("path").string() != sequence.path) continue;
      const core::Json& cameras = sequences.at(i).at("cameras");
      for (std::size_t k = 0; k < cameras.size(); ++k)
        if (cameras.at(k).has("shutter")) return false;
    }
    return true;
  }

  void compare(const FrameWindow& window, EventStream& stream) {
    const int frame = window.frame();
    // Those until this frame's time are in the files of frames before.
    const std::vector<double> gains = stream.take_gains(frame);
    stream.read(window.dataset(), frame, rows_);
    if (stream.camera_index() < 0 || frame == 0 || !has_ideal_images_ ||
        !stream.why_not_light().empty())
      return;
    const std::optional<View> before = window.view(stream.camera_index(), frame - 1);
    const std::optional<View> after = window.view(stream.camera_index(), frame);
    if (!before || !after || before->image == nullptr || after->image == nullptr) return;
    const core::Image8 &was = before->image->color, &is = after->image->color;
    if (was.empty() || is.empty() || was.width() != is.width() || was.height() != is.height() ||
        static_cast<std::size_t>(was.width()) * static_cast<std::size_t>(was.height()) !=
            gains.size())
      return;
    light_.compare(stream, gains, was, is, frame);
  }

  CheckResult light() const {
    constexpr std::size_t kEnough = 100;
    if (std::none_of(streams_.begin(), streams_.end(),
                     [](const EventStream& stream) { return stream.camera_index() >= 0; }))
      return skipped_result("events_light", "no event camera shares the lens of exported images");
    if (!has_ideal_images_)
      return skipped_result("events_light",
                            "images are not as the light is at once: imaging.json, or shutters");
    for (const EventStream& stream : streams_)
      if (stream.camera_index() >= 0 && !stream.why_not_light().empty() && light_.shares.empty())
        return unseen_result("events_light", stream.why_not_light());
    if (light_.shares.size() < kEnough)
      return unseen_result("events_light",
                           fmt::format("{} pixels changed by enough from frame to frame; {} would "
                                       "do",
                                       light_.shares.size(), kEnough));
    std::vector<double> shares = light_.shares;
    const auto middle = shares.begin() + static_cast<std::ptrdiff_t>(shares.size() / 2);
    std::nth_element(shares.begin(), middle, shares.end());
    CheckResult result;
    result.name = "events_light";
    result.value = *middle;
    result.bound = 1.0;
    result.unit = "of what thresholds and rounding allow";
    result.ok = result.is_within_bound();
    result.worst = light_.first;
    result.summary = fmt::format(
        "Median over {} pixels and frames of the difference between the change of ln luminance in "
        "the images and the sum of the pixel's events.",
        shares.size());
    result.reason =
        "A reference is within a threshold of the light at either frame; levels are rounded. "
        "Samples of images are drawn anew for each, which the median leaves out.";
    result.detects = "inverted polarity, events of another frame, another scale of thresholds";
    return result;
  }

  bool is_open_ = false;
  bool is_part_ = false;
  bool has_ideal_images_ = true;
  std::vector<EventStream> streams_;
  FileContradictions rows_;
  LightComparison light_;
};

}  // namespace

std::unique_ptr<Checker> make_events_check(const ValidateOptions& options) {
  return std::make_unique<EventsChecker>(options);
}

}  // namespace terracast::validate
