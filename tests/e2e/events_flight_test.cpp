#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <string>
#include <vector>

#include "core/atomic_file.h"
#include "core/json.h"
#include "tests/support/listed_files.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"
#include "validate/npy.h"

/// A flight with an event camera through the whole program: its datasets hold, and wrong events are found.
namespace terracast::test {
namespace {

namespace fs = std::filesystem;

constexpr int kNumFrames = 6;
constexpr double kFrame_s = 0.05;

constexpr const char* kJob = R"(name = "job"
world = {name = "job", origin_lat_deg = 46.0, origin_lon_deg = 7.0, size_m = 512.0, outside = "extend", elevation = [{kind = "plane", vertical_datum = "ellipsoid", height_m = 500.0}]}
detail.finest_spacing_m = 2.0
trajectories = [{name = "P000", kind = "orbit", centre = {east_m = 0.0, north_m = 0.0, height_m = 30.0, above = "ground"}, radius_m = 60.0, speed_mps = 20.0, rate_hz = 20.0, num_frames = 6}]
conditions.color_samples = 16

[[rigs]]
name = "down"
mount_pitch_deg = 60.0
cameras = [{name = "cam", width_px = 64, height_px = 48, fx_px = 60.0}]

[[rigs.sensors]]
name = "dvs"
kind = "events"
camera = "cam"
rate_hz = 100.0
contrast_on = 0.03
contrast_off = 0.03
samples = 16

[[rigs.sensors]]
name = "own"
kind = "events"
rate_hz = 100.0
width_px = 20
height_px = 12
fx_px = 20.0
shot_noise_hz = 10.0
refractory_us = 100.0

[[exports]]
format = "terracast"
events = ["dsec"]

[[exports]]
format = "colmap"
)";

/// The value and state of a result of a report.
core::Json result_of_report(const core::Json& report, const std::string& name) {
  for (std::size_t i = 0; i < report.at("checks").size(); ++i)
    if (report.at("checks").at(i).at("name").string() == name) return report.at("checks").at(i);
  ADD_FAILURE() << "no result " << name;
  return core::Json::object();
}

/// A row of a file of events, as it lies on disk.
struct EventRow {
  double time_s;
  std::uint16_t x;
  std::uint16_t y;
  std::uint8_t is_on;
};

/// Changes all rows of a file.
void change_rows(const fs::path& file, const std::function<void(EventRow&)>& change) {
  std::vector<std::byte> bytes = core::read_file(file);
  const validate::NpyTable table = validate::parse_npy_table(bytes, file.string());
  ASSERT_EQ(table.row_bytes, 18U);
  for (std::size_t row = 0; row < table.num_rows; ++row) {
    std::byte* const at = bytes.data() + bytes.size() - (table.num_rows - row) * table.row_bytes;
    EventRow event{};
    std::memcpy(&event.time_s, at, 8);
    std::memcpy(&event.x, at + 8, 2);
    std::memcpy(&event.y, at + 10, 2);
    std::memcpy(&event.is_on, at + 12, 1);
    change(event);
    std::memcpy(at, &event.time_s, 8);
    std::memcpy(at + 8, &event.x, 2);
    std::memcpy(at + 10, &event.y, 2);
    std::memcpy(at + 12, &event.is_on, 1);
  }
  core::write_file(file, bytes);
}

TEST(EventsFlight, HoldsAndWrongEventsAreFound) {
  const ScratchFolder scratch;
  core::write_file(scratch / "job.toml", kJob);
  const fs::path out = scratch / "out";
  const ProgramResult run =
      run_program({"run", (scratch / "job.toml").string(), "--out", out.string(), "--quiet"});
  ASSERT_EQ(run.status, 0) << run.output;
  for (const char* format : {"terracast", "colmap"}) {
    const core::Json report = core::Json::read(out / "report" / format / "report.json");
    for (const char* name : {"events", "events_light"}) {
      EXPECT_TRUE(result_of_report(report, name).at("ok").boolean()) << format << ", " << name;
      EXPECT_FALSE(result_of_report(report, name).at("skipped").boolean())
          << format << ", " << name;
    }
  }
  const fs::path right = out / "export/terracast";
  EXPECT_TRUE(fs::exists(right / "P000/sensors/down/dvs/events.h5"));
  EXPECT_TRUE(fs::exists(right / "P000/sensors/down/own/rectify_map.h5"));
  EXPECT_FALSE(fs::exists(out / "export/colmap/P000/sensors/down/dvs/events.h5"));

  const auto path_of = [](const fs::path& dataset, int frame) {
    return dataset / fmt::format("P000/sensors/down/dvs/{:06}.npy", frame);
  };
  const auto failed = [&](const std::string& result, const std::string& name,
                          const std::function<void(const fs::path&)>& spoil) {
    const fs::path dataset = scratch / name;
    fs::copy(right, dataset, fs::copy_options::recursive);
    spoil(dataset);
    list_files_again(dataset);
    const ProgramResult validated =
        run_program({"validate", dataset.string(), "--report",
                     (scratch / (name + "_report")).string(), "--quiet"});
    EXPECT_EQ(validated.status, 1) << name << ": " << validated.output;
    const core::Json report = core::Json::read(scratch / (name + "_report") / "report.json");
    EXPECT_FALSE(result_of_report(report, result).at("ok").boolean()) << name;
    fs::remove_all(dataset);
  };
  const auto in_all_rows = [&](const std::function<void(EventRow&)>& change) {
    return [&, change](const fs::path& dataset) {
      for (int frame = 0; frame < kNumFrames; ++frame) change_rows(path_of(dataset, frame), change);
    };
  };
  failed("events_light", "inverted",
         in_all_rows([](EventRow& row) { row.is_on = row.is_on ? 0 : 1; }));
  failed("events", "in_milliseconds", in_all_rows([](EventRow& row) { row.time_s *= 1e3; }));
  failed("events", "in_thousandths", in_all_rows([](EventRow& row) { row.time_s *= 1e-3; }));
  failed("events", "exchanged", in_all_rows([](EventRow& row) { std::swap(row.x, row.y); }));
  failed("events_light", "mirrored",
         in_all_rows([](EventRow& row) { row.x = static_cast<std::uint16_t>(63 - row.x); }));
  failed("events_light", "a_frame_late", [&](const fs::path& dataset) {
    for (int frame = kNumFrames - 1; frame > 0; --frame) {
      fs::copy_file(path_of(right, frame - 1), path_of(dataset, frame),
                    fs::copy_options::overwrite_existing);
      change_rows(path_of(dataset, frame), [](EventRow& row) { row.time_s += kFrame_s; });
    }
  });
}

}  // namespace
}  // namespace terracast::test
