// Events as DSEC has them, by another reader of HDF5 than the library that writes them.

#include <algorithm>
#include <cmath>
#include <tuple>

#include "core/atomic_file.h"
#include "core/json.h"
#include "tests/export/exported.h"
#include "tests/support/hdf5_reader.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using core::Json;

constexpr const char* kFormat = "format = \"terracast\"\nevents = [\"dsec\"]\n";
const TinyCaptureOptions kTiny{.num_frames = 3, .has_tartan2 = false, .has_events = true};

struct Exported {
  ScratchFolder folder;
  Exported() {
    write_tiny_capture(folder / "capture", kTiny);
    run_export(folder / "capture", kFormat, folder / "out");
  }
  fs::path sensor(const std::string& name) const {
    return folder / "out/terracast/valley/sensors/mcs4" / name;
  }
};

TEST(Dsec, EventsComeBackByAnotherReader) {
  const Exported exported;
  const std::vector<capture::SequenceReader> sequences = open_all(exported.folder / "capture");
  const capture::Samples written = sequences.at(0).read_samples(0);
  const std::size_t count = written.times_s.size();
  ASSERT_GT(count, 2000U);
  const Json file = read_hdf5(exported.sensor("dvs") / "events.h5");
  const auto numbers = [&](const std::string& name) { return file.at(name).at("value").numbers(); };
  const std::vector<double> x = numbers("events/x"), y = numbers("events/y"),
                            p = numbers("events/p"), t = numbers("events/t"),
                            index = numbers("ms_to_idx");
  ASSERT_EQ(x.size(), count);
  ASSERT_EQ(y.size(), count);
  ASSERT_EQ(p.size(), count);
  ASSERT_EQ(t.size(), count);
  for (std::size_t i = 0; i < count; ++i) {
    EXPECT_EQ(x[i], written.values[5 * i]);
    EXPECT_EQ(y[i], written.values[5 * i + 1]);
    EXPECT_EQ(p[i], written.values[5 * i + 2]);
    // Whole microseconds, rounded down: the times are 5 ns and more above them.
    EXPECT_EQ(t[i], std::floor(1e6 * written.times_s[i] + 1e-3)) << i;
  }
  // The first event at or after each millisecond, by counting; the last entry is past all events.
  for (std::size_t m = 0; m < index.size(); ++m)
    EXPECT_EQ(index[m], static_cast<double>(std::count_if(
                            t.begin(), t.end(),
                            [&](double us) { return us < 1000.0 * static_cast<double>(m); })))
        << m;
  EXPECT_EQ(index.back(), static_cast<double>(count));
  EXPECT_GE(1000.0 * static_cast<double>(index.size() - 1), t.back() + 1000.0);
  // 2024-06-21T10:00:00Z.
  EXPECT_EQ(file.at("t_offset").at("value").at(0).number(), 1718964000e6);
  EXPECT_EQ(file.at("events/x").at("dtype").string(), "<u2");
  EXPECT_EQ(file.at("events/p").at("dtype").string(), "<u1");
  EXPECT_EQ(file.at("events/t").at("dtype").string(), "<u4");
  for (const char* name : {"events/x", "events/y", "events/p", "events/t"}) {
    EXPECT_EQ(file.at(name).at("chunks").numbers(), std::vector<double>{1e5});
    // Shuffled, then deflated.
    EXPECT_EQ(file.at(name).at("filters").numbers(), (std::vector<double>{2.0, 1.0}));
  }
}

TEST(Dsec, TheRectifyMapLeadsToAPinhole) {
  const Exported exported;
  for (const auto& [name, width_px, height_px] :
       {std::tuple{"dvs", 48, 32}, std::tuple{"own", 20, 10}}) {
    const Json map = read_hdf5(exported.sensor(name) / "rectify_map.h5").at("rectify_map");
    const std::vector<double> shape = map.at("shape").numbers();
    const std::vector<double> value = map.at("value").numbers();
    ASSERT_EQ(shape.size(), 3U);
    ASSERT_EQ(shape[2], 2.0);
    if (std::string(name) == "own") {
      EXPECT_EQ(shape[0], height_px);
      EXPECT_EQ(shape[1], width_px);
    }
    // Both lenses are pinholes: each pixel lies where it is.
    for (std::size_t i = 0; i < value.size() / 2; ++i) {
      EXPECT_EQ(value[2 * i], static_cast<double>(i % static_cast<std::size_t>(shape[1])));
      EXPECT_EQ(value[2 * i + 1], static_cast<double>(i / static_cast<std::size_t>(shape[1])));
    }
  }
}

TEST(Dsec, TheSameBytesAtAnyTime) {
  const Exported one;
  const Exported two;
  for (const char* file : {"events.h5", "rectify_map.h5"})
    EXPECT_EQ(core::read_text_file(one.sensor("dvs") / file),
              core::read_text_file(two.sensor("dvs") / file));
}

TEST(Dsec, FormsThatAreNotKnownAreRefused) {
  expect_error(core::ErrorKind::Config, {"events", "evt3", "dsec"},
               [] { export_options("format = \"terracast\"\nevents = [\"evt3\"]\n"); });
}

}  // namespace
}  // namespace terracast::test
