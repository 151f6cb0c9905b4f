#include <algorithm>
#include <cmath>
#include <vector>

#include "capture/sequence_files.h"
#include "core/parallel.h"
#include "core/toml_reader.h"
#include "plugins/laws/laws.h"

namespace terracast::plugins {
namespace {

constexpr int kNumScans = 6;

class ScannerLaws {
 public:
  ScannerLaws(const core::Choice<sensors::SensorInfo>& sensor, const sensors::Scanner& scanner,
              const LawScene& world, LawReport& report)
      : sensor_(sensor),
        scanner_(scanner),
        world_(world),
        report_(report),
        // Scans from the motion's beginning to its end.
        rate_hz_(kNumScans / world.duration_s) {}

  void try_all() {
    channels_are_named();
    if (!report_.holds()) return;
    rows_are_whole();
    if (!report_.holds()) return;
    each_is_the_same_by_itself();
    any_threads_are_the_same();
    a_copy_measures_the_same();
    nothing_is_measured_at_no_time();
    its_rays_are_recorded();
  }

 private:
  capture::Samples scan(capture::TickRange ticks, const sensors::Scanner* scanner = nullptr) const {
    const sensors::SensorSite site{.scene = world_.scene,
                                   .body = world_.body,
                                   .body_from_sensor = {},
                                   .rate_hz = rate_hz_,
                                   .stream_seed = 5,
                                   .trail = trail_};
    return (scanner != nullptr ? scanner : &scanner_)->scan(site, ticks);
  }

  void channels_are_named() {
    report_.begin("its channels have names of their own");
    const std::vector<capture::StreamChannel> channels = scanner_.channels();
    const std::string wrong = capture::wrong_channels(channels);
    report_.expect(wrong.empty(), "it " + wrong);
    num_channels_ = channels.size();
  }

  void rows_are_whole() {
    report_.begin("rows follow each other within the time of their scan, every number is one");
    for (int i = 0; i < kNumScans && report_.holds(); ++i) {
      const capture::Samples one = scan({.first = i, .end = i + 1});
      report_.expect(one.values.size() == one.times_s.size() * num_channels_,
                     fmt::format("{} numbers of {} rows of {} channels", one.values.size(),
                                 one.times_s.size(), num_channels_));
      report_.expect(
          capture::are_times_of_scans(one.times_s, {.first = i, .end = i + 1}, rate_hz_),
          fmt::format(
              "scan {} at {} scans a second has rows before it, after it or in another order", i,
              rate_hz_));
      report_.expect(std::none_of(one.values.begin(), one.values.end(),
                                  [](double value) { return std::isnan(value); }),
                     fmt::format("scan {} has a NaN", i));
      if (!report_.holds()) return;
      // What its channels' types cannot hold ends here.
      capture::encode_scans(one, scanner_.channels());
      all_.push_back(one);
    }
  }

  void expect_same(std::size_t scan, const capture::Samples& rows, const std::string& how) const {
    report_.expect(rows == all_[scan], fmt::format("scan {} is another one {}", scan, how));
  }

  void each_is_the_same_by_itself() {
    report_.begin("a scan is the same beside others, as a shard or a resumed run asks for it");
    const capture::Samples together = scan({.first = 0, .end = kNumScans});
    capture::Samples joined;
    for (const capture::Samples& one : all_) {
      joined.times_s.insert(joined.times_s.end(), one.times_s.begin(), one.times_s.end());
      joined.values.insert(joined.values.end(), one.values.begin(), one.values.end());
    }
    report_.expect(together == joined, "several scans at once are not those one by one");
  }

  void any_threads_are_the_same() {
    report_.begin("scans are the same from several threads at once");
    const core::ThreadLimit limit(4);
    std::vector<capture::Samples> scans(kNumScans);
    core::parallel_for(kNumScans, [&](std::int64_t i) {
      scans[static_cast<std::size_t>(i)] = scan({.first = i, .end = i + 1});
    });
    for (std::size_t i = 0; i < kNumScans && report_.holds(); ++i)
      expect_same(i, scans[i], "beside others");
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
    const auto* const copy = dynamic_cast<const sensors::Scanner*>(&*again);
    report_.expect(copy != nullptr, "a copy is no scanner");
    for (int i = 0; i < kNumScans && report_.holds(); ++i)
      expect_same(static_cast<std::size_t>(i), scan({.first = i, .end = i + 1}, copy),
                  "from a copy");
  }

  void nothing_is_measured_at_no_time() {
    report_.begin("no ticks are no scans");
    report_.expect(scan({.first = 3, .end = 3}).times_s.empty(), "there are rows");
  }

  void its_rays_are_recorded() {
    report_.begin("it measures the same while its rays are recorded");
    world::RayTrail trail(world_.scene.viewed().cut().size());
    trail_ = &trail;
    for (int i = 0; i < kNumScans && report_.holds(); ++i)
      expect_same(static_cast<std::size_t>(i), scan({.first = i, .end = i + 1}), "while recorded");
    trail_ = nullptr;
  }

  const core::Choice<sensors::SensorInfo>& sensor_;
  const sensors::Scanner& scanner_;
  const LawScene& world_;
  LawReport& report_;
  double rate_hz_;
  std::size_t num_channels_ = 0;
  world::RayTrail* trail_ = nullptr;
  std::vector<capture::Samples> all_;
};

}  // namespace

void try_scanner(const core::Choice<sensors::SensorInfo>& sensor, const sensors::Scanner& scanner,
                 const LawScene& world, LawReport& report) {
  ScannerLaws(sensor, scanner, world, report).try_all();
}

}  // namespace terracast::plugins
