#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/scratch_pool.h"
#include "geo/camera_model.h"
#include "sensors/camera/pixel_blocks.h"
#include "sensors/events/pixel_block.h"
#include "sensors/events/scene_looks.h"
#include "sensors/sensor.h"

/// Event cameras: each pixel says when the light that it sees has changed by a threshold, in a world that is looked at as often
/// as its motion and its contrasts need.
///
/// A pixel's reference follows from all that it saw since the sequence's start. A scan is thus made of those before it: a run
/// that makes frames in turn carries the pixels' states from one to the next; one that begins later first makes the events
/// before its own once more, and drops them.
namespace terracast::sensors {
namespace {

using capture::NumberType;
using core::ErrorKind;
using core::fail;

constexpr int kBlockSide_px = 16;
/// Of the light of what moves, which goes on from one state over a span; also the longest step.
constexpr double kSpan_s = 0.01;

/// The channels, in the order of channels().
enum Column : std::size_t { kX, kY, kPolarity, kIsNoise, kContrast, kNumColumns };

/// The pixels of a run that makes scans in turn.
struct EventMemory : ScanMemory {
  std::vector<events::PixelBlock> blocks;
  std::int64_t next_tick = 0;
};

class Events : public Scanner {
 public:
  void describe(core::SchemaVisitor& visit) override;
  void validate() const override;
  std::unique_ptr<Sensor> clone() const override { return std::make_unique<Events>(*this); }
  std::string camera() const override { return camera_; }
  std::vector<capture::StreamChannel> channels() const override;
  double rows_per_s(double /*rate_hz*/) const override { return 0.0; }
  double least_rays_per_s(double rate_hz, const capture::CameraCalibration* camera) const override {
    const double num_pixels =
        camera != nullptr
            ? static_cast<double>(camera->intrinsics.width_px) * camera->intrinsics.height_px
            : static_cast<double>(width_px_) * static_cast<double>(height_px_);
    return num_pixels * static_cast<double>(samples_) * num_spans(rate_hz) * rate_hz;
  }
  capture::Samples scan(const SensorSite& site, const capture::TickRange& ticks) const override;

 private:
  /// What a scan works with.
  struct Setup {
    const SensorSite& site;
    const geo::CameraModel& model;
    events::Pixels pixels;
    scene::PixelSampler sampler;
    events::StepRule rule;
  };

  static int num_spans(double rate_hz) {
    return std::max(1, static_cast<int>(std::ceil(1.0 / (rate_hz * kSpan_s) - 1e-9)));
  }
  std::unique_ptr<geo::CameraModel> model_of(const SensorSite& site) const;
  events::StepRule rule_of(const SensorSite& site) const;
  void for_each_block(const Setup& setup, const events::TimeSpan& span, world::RayTrail* trail,
                      std::vector<events::PixelBlock>& blocks, bool is_start,
                      std::vector<events::Event>& found) const;
  void start(const Setup& setup, world::RayTrail* trail, EventMemory& memory) const;
  std::vector<events::Event> advance(const Setup& setup, world::RayTrail* trail,
                                     EventMemory& memory) const;
  void append(const std::vector<events::Event>& found, capture::Samples& rows,
              std::int64_t width_px) const;

  std::string camera_;
  std::int64_t width_px_ = 0;
  std::int64_t height_px_ = 0;
  double fx_px_ = 0.0;
  events::PixelOptions pixel_;
  std::int64_t samples_ = 8;
  double brightness_step_ = 0.5;
  double flow_step_px_ = 0.5;
  double finest_step_us_ = 100.0;
};

void Events::describe(core::SchemaVisitor& visit) {
  visit.key("camera", camera_,
            "Camera of the rig through whose lens it looks, at its place and with its pixels; "
            "empty: it has an ideal lens of its own (width_px, height_px, fx_px).");
  visit.key("width_px", width_px_, "Pixels in a row, without camera.", core::between(0, 4096));
  visit.key("height_px", height_px_, "Rows, without camera.", core::between(0, 4096));
  visit.key("fx_px", fx_px_, "Focal length in pixels, without camera.", core::between(0.0, 1e6));
  pixel_.describe(visit);
  visit.key("samples", samples_,
            "Rays over a pixel, the same for all time; a power of two spreads them best.",
            core::between(1, 256));
  visit.key("brightness_step", brightness_step_,
            "A pixel is looked at again before it has changed by this share of the lower contrast.",
            core::between(1e-3, 1.0));
  visit.key("flow_step_px", flow_step_px_,
            "A pixel is looked at again before its image has moved by this.",
            core::between(1e-3, 2.0));
  visit.key("finest_step_us", finest_step_us_, "But not after less than this.",
            core::between(1.0, 1e4));
}

void Events::validate() const {
  pixel_.validate();
  const bool has_own = width_px_ != 0 || height_px_ != 0 || fx_px_ != 0.0;
  if (!camera_.empty() && has_own)
    fail(ErrorKind::Config,
         "width_px, height_px or fx_px beside camera = \"{}\", whose lens it has; leave them out",
         camera_);
  if (camera_.empty() && !(width_px_ > 0 && height_px_ > 0 && fx_px_ > 0.0))
    fail(
        ErrorKind::Config,
        "no lens: give camera, a camera of the rig, or width_px, height_px and fx_px (they are {}, "
        "{} and {})",
        width_px_, height_px_, fx_px_);
}

std::vector<capture::StreamChannel> Events::channels() const {
  return {{.name = "x_px", .unit = "px", .type = NumberType::Count16},
          {.name = "y_px", .unit = "px", .type = NumberType::Count16},
          {.name = "polarity", .unit = "", .type = NumberType::Count8},
          {.name = "is_noise", .unit = "", .type = NumberType::Count8},
          {.name = "contrast", .unit = "", .type = NumberType::Float32}};
}

std::unique_ptr<geo::CameraModel> Events::model_of(const SensorSite& site) const {
  if (site.camera != nullptr) return geo::make_camera(site.camera->intrinsics);
  if (!camera_.empty())
    fail(ErrorKind::Config, "an event camera looks through camera = \"{}\", which is not there",
         camera_);
  return geo::make_camera({.model = "pinhole",
                           .width_px = static_cast<int>(width_px_),
                           .height_px = static_cast<int>(height_px_),
                           .parameters = {fx_px_, fx_px_, 0.5 * static_cast<double>(width_px_),
                                          0.5 * static_cast<double>(height_px_)}});
}

events::StepRule Events::rule_of(const SensorSite& site) const {
  // Samples lie so far apart. What moves by itself, or its shadow, may pass where the image stands still.
  const double pitch_px = 1.0 / std::sqrt(static_cast<double>(samples_));
  return {.brightness_step = brightness_step_ * std::min(pixel_.contrast_on, pixel_.contrast_off),
          .flow_step_px = flow_step_px_,
          .finest_px = site.scene.moving().is_empty() ? 0.5 * pitch_px : 0.0,
          .finest_s = 1e-6 * finest_step_us_};
}

/// Starts all blocks at a span's beginning, or takes them through it.
void Events::for_each_block(const Setup& setup, const events::TimeSpan& span,
                            world::RayTrail* trail, std::vector<events::PixelBlock>& blocks,
                            bool is_start, std::vector<events::Event>& found) const {
  const events::SceneLooks looks(setup.site, setup.model, pixel_, setup.sampler,
                                 static_cast<int>(samples_), span, trail);
  core::ScratchPool<events::SceneLooks::Scratch> pool;
  std::vector<std::vector<events::Event>> of_blocks(blocks.size());
  setup.site.scene.whole().run_units(static_cast<std::int64_t>(blocks.size()), [&](std::int64_t i) {
    core::ScratchPool<events::SceneLooks::Scratch>::Lease scratch(pool);
    const events::LookAt look_at = [&](std::span<const events::LookPlace> places,
                                       std::span<events::Look> into) {
      looks.look(places, into, *scratch);
    };
    events::PixelBlock& block = blocks[static_cast<std::size_t>(i)];
    if (is_start)
      block.start(setup.pixels, span.start_s, look_at);
    else
      of_blocks[static_cast<std::size_t>(i)] =
          block.advance(setup.pixels, setup.rule, span, look_at);
  });
  const std::size_t first = found.size();
  for (std::vector<events::Event>& block : of_blocks) {
    found.insert(found.end(), block.begin(), block.end());
    block = {};
  }
  events::sort_events(std::span(found).subspan(first));
}

void Events::start(const Setup& setup, world::RayTrail* trail, EventMemory& memory) const {
  const auto grid =
      PixelGrid::of_squares(setup.model.width_px(), setup.model.height_px(), kBlockSide_px);
  memory.blocks.clear();
  memory.next_tick = 0;
  for (const int i : grid.units_by_place()) {
    std::vector<std::uint32_t> pixels;
    for_each_pixel(grid.unit(i), [&](int x, int y) {
      pixels.push_back(static_cast<std::uint32_t>(y * setup.model.width_px() + x));
    });
    memory.blocks.emplace_back(std::move(pixels));
  }
  std::vector<events::Event> none;
  for_each_block(setup, {.start_s = 0.0, .end_s = 0.0}, trail, memory.blocks, true, none);
}

/// The events of the next tick.
std::vector<events::Event> Events::advance(const Setup& setup, world::RayTrail* trail,
                                           EventMemory& memory) const {
  const double rate_hz = setup.site.rate_hz;
  const auto tick = static_cast<double>(memory.next_tick++);
  const int num = num_spans(rate_hz);
  std::vector<events::Event> found;
  for (int i = 0; i < num; ++i) {
    const auto time_at = [&](int part) {
      return part == num ? (tick + 1.0) / rate_hz
                         : (tick + static_cast<double>(part) / num) / rate_hz;
    };
    for_each_block(setup, {.start_s = time_at(i), .end_s = time_at(i + 1)}, trail, memory.blocks,
                   false, found);
    if (static_cast<double>(found.size()) > kMostRows)
      fail(ErrorKind::Config,
           "more than {:.3g} events in the {} s from {:.3f} s on; take a higher rate_hz, higher "
           "contrasts or fewer pixels",
           kMostRows, 1.0 / rate_hz, tick / rate_hz);
  }
  return found;
}

void Events::append(const std::vector<events::Event>& found, capture::Samples& rows,
                    std::int64_t width_px) const {
  for (const events::Event& event : found) {
    rows.times_s.push_back(static_cast<double>(event.time_ns) / 1e9);
    const std::size_t row = rows.values.size();
    rows.values.resize(row + kNumColumns);
    double* const values = &rows.values[row];
    values[kX] = static_cast<double>(event.pixel % width_px);
    values[kY] = static_cast<double>(event.pixel / width_px);
    values[kPolarity] = event.is_on ? 1.0 : 0.0;
    values[kIsNoise] = event.is_noise ? 1.0 : 0.0;
    values[kContrast] = static_cast<double>(event.contrast);
  }
}

capture::Samples Events::scan(const SensorSite& site, const capture::TickRange& ticks) const {
  capture::Samples rows;
  if (ticks.first >= ticks.end) return rows;
  const std::unique_ptr<geo::CameraModel> model = model_of(site);
  const Setup setup{.site = site,
                    .model = *model,
                    .pixels = events::Pixels(pixel_, site.stream_seed),
                    .sampler = scene::PixelSampler(static_cast<int>(samples_)),
                    .rule = rule_of(site)};
  std::unique_ptr<ScanMemory> own;
  std::unique_ptr<ScanMemory>& kept = site.memory != nullptr ? *site.memory : own;
  auto* memory = dynamic_cast<EventMemory*>(kept.get());
  if (memory == nullptr || memory->next_tick > ticks.first) {
    kept = std::make_unique<EventMemory>();
    memory = static_cast<EventMemory*>(kept.get());
    start(setup, ticks.first == 0 ? site.trail : nullptr, *memory);
  }
  // Not this scan's own: whoever makes that one records what it visits.
  while (memory->next_tick < ticks.first) advance(setup, nullptr, *memory);
  while (memory->next_tick < ticks.end) {
    append(advance(setup, site.trail, *memory), rows, model->width_px());
    if (static_cast<double>(rows.times_s.size()) > kMostRows)
      fail(ErrorKind::Config,
           "more than {:.3g} events from a frame to the next; take a higher rate_hz of the "
           "trajectory, higher contrasts or fewer pixels",
           kMostRows);
  }
  return rows;
}

}  // namespace

SensorInfo events_sensor() {
  return {.name = "events",
          .summary = "an event camera: each pixel's changes of light, each at its own time",
          .make = [] { return std::unique_ptr<Sensor>(std::make_unique<Events>()); }};
}

}  // namespace terracast::sensors
