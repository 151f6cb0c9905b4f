#include "sensors/camera/imaging/imager.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/hash.h"
#include "core/parallel.h"
#include "core/schema_writer.h"
#include "sensors/camera/imaging/lens.h"

namespace terracast::sensors {
namespace {

constexpr int kRowsAtOnce = 16;

/// Of a camera's draws in a sequence, by their names.
std::uint64_t stream_of_camera(const capture::CameraCalibration& camera,
                               const std::string& sequence) {
  const std::string names = "imaging " + sequence + "/" + camera.rig + "/" + camera.name;
  return core::content_hash64(std::as_bytes(std::span(names)));
}

std::vector<ExposureOptions> exposures_of(const std::vector<ImagingOptions>& options) {
  std::vector<ExposureOptions> exposures;
  for (const ImagingOptions& camera : options) exposures.push_back(camera.exposure);
  return exposures;
}

void multiply(core::ImageF& light, const core::ImageF& share) {
  for (std::size_t i = 0; i < light.data().size(); ++i) light.data()[i] *= share.data()[i / 3];
}

/// Light as digital numbers say it was, each multiplied by the gain of its colour; no colour is brighter
/// than the darkest of those that are full, lest what is too bright takes on a tint.
core::ImageF balanced(const ImageSensor& sensor, const core::Image16& numbers,
                      const scene::Color& gains) {
  const float white = sensor.exposure_of(sensor.white_level_dn()) * gains.minCoeff();
  core::ImageF light(numbers.width(), numbers.height(), numbers.channels());
  for (int y = 0; y < numbers.height(); ++y)
    for (int x = 0; x < numbers.width(); ++x)
      for (int k = 0; k < numbers.channels(); ++k) {
        const int color = sensor.mosaic() ? sensor.mosaic()->channel_at(x, y) : k;
        light(x, y, k) = std::min(sensor.exposure_of(numbers(x, y, k)) * gains[color], white);
      }
  return light;
}

}  // namespace

capture::CameraImaging describe_imaging(const ImagingOptions& options,
                                        const capture::CameraCalibration& camera, std::int64_t seed,
                                        const std::string& sequence) {
  capture::CameraImaging imaging{.settings_toml = core::toml_text(options)};
  if (!options.sensor.is_on()) return imaging;
  const ImageSensor sensor(options.sensor, static_cast<std::uint64_t>(seed),
                           stream_of_camera(camera, sequence));
  ImageSensor::Defects defects =
      sensor.find_defects(camera.intrinsics.width_px, camera.intrinsics.height_px);
  imaging.dead_sites = std::move(defects.dead);
  imaging.hot_sites = std::move(defects.hot);
  if (options.sensor.has_mosaic())
    imaging.raw = {.mosaic = options.sensor.mosaic,
                   .bits = static_cast<int>(options.sensor.bits),
                   .black_level_dn = options.sensor.black_level_dn,
                   .white_level_dn = static_cast<double>(sensor.white_level_dn()),
                   .dn_per_electron = sensor.dn_per_electron()};
  return imaging;
}

Imager::Imager(const ImagingOptions& options, const capture::CameraCalibration& camera,
               const geo::CameraModel& model, std::int64_t seed, const std::string& sequence,
               float level, const scene::Color& balance)
    : options_(options),
      center_px_(optical_center_px(model)),
      development_(options.color),
      level_(level),
      balance_(balance) {
  const auto seed_bits = static_cast<std::uint64_t>(seed);
  const std::uint64_t stream = stream_of_camera(camera, sequence);
  if (options.lens.vignetting_exponent > 0.0 || !options.lens.vignetting_polynomial.empty())
    vignetting_ = vignetting_of(options.lens, model);
  soiling_ = draw_soiling(options.soiling, model.width_px(), model.height_px(), seed_bits, stream);
  if (options.sensor.is_on()) sensor_.emplace(options.sensor, seed_bits, stream);
}

void Imager::pass_lens(core::ImageF& light) const {
  lay_soiling(options_.soiling, soiling_, light);
  if (!vignetting_.empty()) multiply(light, vignetting_);
  scale_colors(options_.lens, center_px_, light);
  add_glare(options_.lens, light);
}

scene::Color Imager::gains(const scene::Color& grey) const {
  const ColorOptions& color = options_.color;
  if (color.white_balance == "temperature") return gains_of_temperature(color.temperature_k);
  if (color.white_balance == "gains")
    return Eigen::Array3d(color.gains[0], color.gains[1], color.gains[2]).cast<float>();
  if (color.white_balance == "grey_world")
    return balance_ * scene::luminance_of(grey) / grey.max(1e-6f);
  return balance_;
}

Photo Imager::photograph(core::ImageF light, int frame, double exposure_ev,
                         const scene::Color& grey) const {
  pass_lens(light);
  const float exposure = level_ * static_cast<float>(std::exp2(exposure_ev));
  for (float& value : light.data()) value *= exposure;

  Photo photo{.color = core::Image8(light.width(), light.height(), 3),
              .raw = {},
              .exposure_ev = exposure_ev};
  const scene::Color balance = gains(grey);
  if (sensor_) {
    core::Image16 numbers = sensor_->read(light, frame);
    light = balanced(*sensor_, numbers, balance);
    if (sensor_->mosaic()) {
      light = sensor_->mosaic()->demosaiced(light);
      photo.raw = std::move(numbers);
    }
  } else {
    for (std::size_t i = 0; i < light.data().size(); ++i)
      light.data()[i] *= balance[static_cast<Eigen::Index>(i % 3)];
  }
  core::parallel_for_blocks(light.height(), kRowsAtOnce, [&](std::int64_t begin, std::int64_t end) {
    for (auto y = static_cast<int>(begin); y < end; ++y)
      for (int x = 0; x < light.width(); ++x)
        development_.develop({light(x, y, 0), light(x, y, 1), light(x, y, 2)}, &photo.color(x, y));
  });
  return photo;
}

Imagers::Imagers(const std::vector<ImagingOptions>& options,
                 const std::vector<capture::CameraCalibration>& cameras,
                 const std::vector<const geo::CameraModel*>& models, std::vector<double> times_s,
                 std::int64_t seed, const std::string& sequence, float level,
                 const scene::Color& balance, LightMeters::Look look)
    : options_(options),
      times_s_(std::move(times_s)),
      meters_(exposures_of(options), std::move(look)) {
  for (std::size_t i = 0; i < options.size(); ++i) {
    std::vector<int>& rig = rigs_.emplace_back();
    for (std::size_t k = 0; k < cameras.size(); ++k)
      if (cameras[k].rig == cameras[i].rig) rig.push_back(static_cast<int>(k));
    imagers_.push_back(options[i].is_on()
                           ? std::make_unique<Imager>(options[i], cameras[i], *models[i], seed,
                                                      sequence, level, balance)
                           : nullptr);
  }
}

double Imagers::wanted_ev_at(int frame, int camera) const {
  const ExposureOptions& options = options_[static_cast<std::size_t>(camera)].exposure;
  if (options.lock == "camera") return wanted_ev(options, meters_.read(frame, camera).luminance);
  // What all together want: the mean of the stops that each does.
  double sum = 0.0;
  const std::vector<int>& rig = rigs_[static_cast<std::size_t>(camera)];
  for (const int other : rig) sum += wanted_ev(options, meters_.read(frame, other).luminance);
  return sum / static_cast<double>(rig.size());
}

double Imagers::exposure_ev(int frame, int camera) const {
  const ExposureOptions& options = options_[static_cast<std::size_t>(camera)].exposure;
  if (!options.is_automatic()) return options.bias_ev;
  return options.bias_ev + followed_ev(times_s_, frame, options.time_constant_s,
                                       [&](int at) { return wanted_ev_at(at, camera); });
}

Photo Imagers::photograph(core::ImageF light, int frame, int camera) const {
  const auto index = static_cast<std::size_t>(camera);
  scene::Color grey = scene::Color::Ones();
  if (options_[index].color.white_balance == "grey_world") {
    grey.setZero();
    for (const int other : rigs_[index]) grey += meters_.read(0, other).mean;
    grey /= static_cast<float>(rigs_[index].size());
  }
  return imagers_[index]->photograph(std::move(light), frame, exposure_ev(frame, camera), grey);
}

}  // namespace terracast::sensors
