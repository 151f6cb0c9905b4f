#include <bit>
#include <cmath>

#include "core/parallel.h"
#include "core/toml_reader.h"
#include "plugins/laws/laws.h"

namespace terracast::plugins {
namespace {

constexpr std::size_t kNumTimes = 64;

class SensorLaws {
 public:
  SensorLaws(const core::Choice<sensors::SensorInfo>& sensor, const LawScene& world,
             LawReport& report)
      : sensor_(sensor), world_(world), report_(report) {
    for (std::size_t i = 0; i < kNumTimes; ++i)
      times_s_.push_back(world.duration_s * static_cast<double>(i) / (kNumTimes - 1));
  }

  void try_all() {
    channels_are_named();
    if (!report_.holds()) return;  // nor would they be told apart
    every_channel_of_every_sample_is_written();
    each_is_the_same_by_itself();
    any_order_is_the_same();
    any_threads_are_the_same();
    a_copy_measures_the_same();
    nothing_is_measured_at_no_time();
    its_rays_are_recorded();
  }

 private:
  std::vector<double> measure(std::vector<double> times_s,
                              const sensors::Sensor* sensor = nullptr) {
    // Written where nothing is measured: a NaN of these very bits.
    std::vector<double> values(times_s.size() * num_channels_, std::bit_cast<double>(kUnwritten));
    const sensors::SensorSite site{.scene = world_.scene,
                                   .body = world_.body,
                                   .body_from_sensor = {},
                                   .rate_hz = 100.0,
                                   .stream_seed = 5,
                                   .trail = trail_};
    (sensor != nullptr ? *sensor : *sensor_).measure(site, times_s, values);
    return values;
  }

  void channels_are_named() {
    report_.begin("its channels have names of their own");
    const std::vector<capture::StreamChannel> channels = sensor_->channels();
    const std::string wrong = capture::wrong_channels(channels);
    report_.expect(wrong.empty(), "it " + wrong);
    num_channels_ = channels.size();
  }

  void every_channel_of_every_sample_is_written() {
    report_.begin("every channel of every sample is written, and no number is NaN");
    all_ = measure(times_s_);
    for (std::size_t i = 0; i < all_.size() && report_.holds(); ++i) {
      if (!std::isnan(all_[i])) continue;
      const bool is_unwritten = std::bit_cast<std::uint64_t>(all_[i]) == kUnwritten;
      report_.broken(
          fmt::format("{} of the sample at {} s is {}", sensor_->channels()[i % num_channels_].name,
                      times_s_[i / num_channels_], is_unwritten ? "not written" : "NaN"));
    }
  }

  void expect_same(std::size_t time, std::span<const double> values, const std::string& how) {
    for (std::size_t k = 0; k < num_channels_; ++k) {
      const double expected = all_[time * num_channels_ + k];
      report_.expect(
          std::bit_cast<std::uint64_t>(values[k]) == std::bit_cast<std::uint64_t>(expected),
          fmt::format("{} of the sample at {} s is {:.17g} {}, and else {:.17g}",
                      sensor_->channels()[k].name, times_s_[time], values[k], how, expected));
    }
  }

  void each_is_the_same_by_itself() {
    report_.begin("a sample is the same by itself, as a shard or a resumed run asks for it");
    for (std::size_t i = 0; i < kNumTimes && report_.holds(); ++i)
      expect_same(i, measure({times_s_[i]}), "by itself");
  }

  void any_order_is_the_same() {
    report_.begin("samples are the same in any order");
    const std::vector<double> values = measure({times_s_.rbegin(), times_s_.rend()});
    for (std::size_t i = 0; i < kNumTimes && report_.holds(); ++i)
      expect_same(i, std::span(values).subspan((kNumTimes - 1 - i) * num_channels_), "backwards");
  }

  void any_threads_are_the_same() {
    report_.begin("samples are the same from several threads at once");
    const core::ThreadLimit limit(4);
    std::vector<std::vector<double>> values(kNumTimes);
    core::parallel_for(kNumTimes, [&](std::int64_t i) {
      values[static_cast<std::size_t>(i)] = measure({times_s_[static_cast<std::size_t>(i)]});
    });
    for (std::size_t i = 0; i < kNumTimes && report_.holds(); ++i)
      expect_same(i, values[i], "beside others");
  }

  void a_copy_measures_the_same() {
    report_.begin("its options read back, and a copy measures the same");
    core::Choice<sensors::SensorInfo> again;
    struct Read {
      core::Choice<sensors::SensorInfo>& choice;
      void describe(core::SchemaVisitor& visit) {
        choice.describe(visit, "kind", "sensor", "", sensors::sensors());
      }
    } read{again};
    core::TomlDocument::parse(
        fmt::format("kind = \"{}\"\n{}", sensor_.kind(), sensor_.settings_toml()), "options")
        .read(read);
    report_.expect(again.settings_toml() == sensor_.settings_toml(), "other options come back");
    const std::vector<double> values = measure(times_s_, &*again);
    for (std::size_t i = 0; i < kNumTimes && report_.holds(); ++i)
      expect_same(i, std::span(values).subspan(i * num_channels_), "from a copy");
  }

  void nothing_is_measured_at_no_time() {
    report_.begin("no times are no samples");
    measure({});
  }

  void its_rays_are_recorded() {
    report_.begin("it measures the same while its rays are recorded");
    world::RayTrail trail(world_.scene.viewed().cut().size());
    trail_ = &trail;
    const std::vector<double> values = measure(times_s_);
    trail_ = nullptr;
    for (std::size_t i = 0; i < kNumTimes && report_.holds(); ++i)
      expect_same(i, std::span(values).subspan(i * num_channels_), "while recorded");
  }

  static constexpr std::uint64_t kUnwritten = 0x7ff8'7465'7272'6163;

  const core::Choice<sensors::SensorInfo>& sensor_;
  const LawScene& world_;
  LawReport& report_;
  std::vector<double> times_s_;
  std::size_t num_channels_ = 0;
  world::RayTrail* trail_ = nullptr;
  std::vector<double> all_;
};

}  // namespace

void try_sensor(const core::Choice<sensors::SensorInfo>& sensor, const LawScene& world,
                LawReport& report) {
  if (const auto* const scanner = dynamic_cast<const sensors::Scanner*>(&*sensor))
    return try_scanner(sensor, *scanner, world, report);
  SensorLaws(sensor, world, report).try_all();
}

}  // namespace terracast::plugins
