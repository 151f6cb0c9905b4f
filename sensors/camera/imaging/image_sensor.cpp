#include "sensors/camera/imaging/image_sensor.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "core/random.h"
#include "sensors/deviates.h"

namespace terracast::sensors {
namespace {

constexpr int kRowsAtOnce = 16;

/// What is drawn of a photosite once a sequence, and in each frame.
enum FixedDraw : std::uint64_t { kSensitivity, kDarkSignal, kDefect, kNumFixedDraws };
enum FrameDraw : std::uint64_t { kShot, kReading, kNumFrameDraws };

}  // namespace

ImageSensor::ImageSensor(const ImageSensorOptions& options, std::uint64_t seed,
                         std::uint64_t stream)
    : options_(options),
      seed_(seed),
      stream_(core::stream_of(stream, 0x73656e736f72)),  // "sensor"
      white_level_dn_((1 << options.bits) - 1) {
  if (options.has_mosaic()) mosaic_.emplace(options.mosaic);
  const double range_dn = white_level_dn_ - options.black_level_dn;
  dn_per_exposure_ = range_dn / options.saturation_exposure;
  dn_per_electron_ =
      options.full_well_e > 0.0 ? range_dn * options.gain / options.full_well_e : 0.0;
  zero_dn_ = options.black_level_dn + dn_per_electron_ * options.dark_signal_e;
}

ImageSensor::Defect ImageSensor::defect_at(std::uint64_t site) const {
  if (!options_.has_defects()) return Defect::None;
  const double draw = core::random_unit(seed_, stream_, site * kNumFixedDraws + kDefect);
  if (draw < options_.dead_share) return Defect::Dead;
  return draw < options_.dead_share + options_.hot_share ? Defect::Hot : Defect::None;
}

std::uint16_t ImageSensor::number_of(double exposed, std::uint64_t site,
                                     std::uint64_t frame_stream) const {
  const Defect defect = defect_at(site);
  if (defect == Defect::Hot) return static_cast<std::uint16_t>(white_level_dn_);
  if (defect == Defect::Dead) exposed = 0.0;
  double number = options_.black_level_dn;
  if (dn_per_electron_ > 0.0) {
    const auto fixed = [&](FixedDraw which) {
      return normal_deviate(
          open_unit(core::random_bits(seed_, stream_, site * kNumFixedDraws + which)));
    };
    const auto unit = [&](FrameDraw which) {
      return open_unit(core::random_bits(seed_, frame_stream, site * kNumFrameDraws + which));
    };
    double signal_e = exposed * dn_per_exposure_ / dn_per_electron_;
    if (options_.prnu_percent > 0.0)
      signal_e *= std::max(1.0 + 0.01 * options_.prnu_percent * fixed(kSensitivity), 0.0);
    double counted_e = poisson_deviate(signal_e + options_.dark_signal_e, unit(kShot));
    if (options_.dsnu_e > 0.0) counted_e += options_.dsnu_e * fixed(kDarkSignal);
    if (options_.read_noise_e > 0.0)
      counted_e += options_.read_noise_e * normal_deviate(unit(kReading));
    number += dn_per_electron_ * counted_e;
  } else {
    number += exposed * dn_per_exposure_;
  }
  return static_cast<std::uint16_t>(
      std::clamp(std::floor(number + 0.5), 0.0, static_cast<double>(white_level_dn_)));
}

core::Image16 ImageSensor::read(const core::ImageF& exposed, int frame) const {
  core::Image16 numbers(exposed.width(), exposed.height(), mosaic_ ? 1 : 3);
  const std::uint64_t frame_stream =
      core::stream_of(stream_, static_cast<std::uint64_t>(frame) + 1);
  core::parallel_for_blocks(
      exposed.height(), kRowsAtOnce, [&](std::int64_t begin, std::int64_t end) {
        for (auto y = static_cast<int>(begin); y < end; ++y) {
          auto site = static_cast<std::uint64_t>(y) * numbers.row_size();
          for (int x = 0; x < exposed.width(); ++x)
            for (int k = 0; k < numbers.channels(); ++k, ++site)
              numbers(x, y, k) = number_of(exposed(x, y, mosaic_ ? mosaic_->channel_at(x, y) : k),
                                           site, frame_stream);
        }
      });
  return numbers;
}

ImageSensor::Defects ImageSensor::find_defects(int width_px, int height_px) const {
  Defects defects;
  if (!options_.has_defects()) return defects;
  const std::int64_t num_sites = std::int64_t{width_px} * height_px * (mosaic_ ? 1 : 3);
  for (std::int64_t site = 0; site < num_sites; ++site) {
    const Defect defect = defect_at(static_cast<std::uint64_t>(site));
    if (defect == Defect::Dead) defects.dead.push_back(site);
    if (defect == Defect::Hot) defects.hot.push_back(site);
  }
  return defects;
}

}  // namespace terracast::sensors
