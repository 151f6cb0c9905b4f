#include "geo/geoid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <limits>
#include <sstream>
#include <thread>
#include <vector>

#include "core/error.h"
#include "core/random.h"
#include "tests/support/test_data.h"

namespace terracast::geo {
namespace {

namespace fs = std::filesystem;

const fs::path kGtx = "/usr/share/proj/egm96_15.gtx";
#define NEEDS_GRID() \
  if (!fs::exists(kGtx)) GTEST_SKIP() << kGtx.string() << " is missing: install proj-data"

std::string bytes_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void write_bytes(const fs::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary) << bytes;
}

/// The last 2 x 1440 x 721 bytes of a pgm file.
std::string pixels_of(const fs::path& file) {
  const std::string bytes = bytes_of(file);
  constexpr std::size_t kPixelBytes = 2 * 1440 * 721;
  return bytes.size() < kPixelBytes ? "" : bytes.substr(bytes.size() - kPixelBytes);
}

core::ErrorKind kind_of_failure(const fs::path& gtx, const fs::path& cache) {
  try {
    Geoid::egm96(gtx, cache);
  } catch (const core::Error& error) {
    EXPECT_NE(error.message().find(gtx.filename().string()), std::string::npos) << error.message();
    return error.kind();
  }
  ADD_FAILURE() << "no error";
  return core::ErrorKind::Internal;
}

struct Published {
  double lat_deg, lon_deg, undulation_m;
};

TEST(Geoid, MatchesNgaPublishedPoints) {
  NEEDS_GRID();
  const test::ScratchFolder scratch;
  const auto geoid = Geoid::egm96(kGtx, scratch.path());
  // Outputs that NGA published with its EGM96 interpolation program.
  for (const Published& point :
       {Published{38.6281550, 269.7791550, -31.628}, Published{-14.6212170, 305.0211140, -2.969},
        Published{46.8743190, 102.4487290, -43.575}, Published{-23.6174460, 133.8747120, 15.871},
        Published{38.6254730, 359.9995000, 50.066}, Published{-0.4667440, 0.0023000, 17.329}}) {
    EXPECT_NEAR(geoid->undulation_m(point.lat_deg, point.lon_deg), point.undulation_m, 0.01);
    EXPECT_NEAR(geoid->undulation_m(point.lat_deg, point.lon_deg - 360.0), point.undulation_m,
                0.01);
  }
}

TEST(Geoid, MatchesEveryPointOfTheSharedTable) {
  NEEDS_GRID();
  TERRACAST_NEEDS_SHARED_DATA("geoid/egm96_test_points.csv");
  const test::ScratchFolder scratch;
  const auto geoid = Geoid::egm96(kGtx, scratch.path());
  std::ifstream table(test::shared_data() / "geoid" / "egm96_test_points.csv");
  std::string line;
  std::getline(table, line);
  int num_points = 0;
  while (std::getline(table, line)) {
    std::istringstream row(line);
    std::string source;
    double lat_deg = 0, lon_deg = 0, published_m = 0, cubic_m = 0;
    char comma = 0;
    row >> lat_deg >> comma >> lon_deg >> comma >> published_m >> comma;
    std::getline(row, source, ',');
    row >> cubic_m;
    ASSERT_TRUE(row) << line;
    EXPECT_NEAR(geoid->undulation_m(lat_deg, lon_deg), published_m, 0.01) << line;
    // GeoidEval's answer, printed to 0.1 mm, from the same nodes.
    EXPECT_NEAR(geoid->undulation_m(lat_deg, lon_deg), cubic_m, 0.0002) << line;
    ++num_points;
  }
  EXPECT_EQ(num_points, 11);
}

TEST(Geoid, WritesTheSameNodesAsGeographicLibsOwnGrid) {
  NEEDS_GRID();
  TERRACAST_NEEDS_SHARED_DATA("geoid/egm96-15.pgm");
  const test::ScratchFolder scratch;
  Geoid::egm96(kGtx, scratch.path());
  const std::string ours = pixels_of(scratch / "egm96-15.pgm");
  const std::string theirs = pixels_of(test::shared_data() / "geoid" / "egm96-15.pgm");
  ASSERT_EQ(ours.size(), theirs.size());
  // Both round the same undulations to 3 mm. Nodes that lie half-way between two steps, to the
  // float's last digit, go either way: 164 of a million.
  const auto pixel = [](const std::string& bytes, std::size_t i) {
    return 256 * static_cast<unsigned char>(bytes[2 * i]) +
           static_cast<unsigned char>(bytes[2 * i + 1]);
  };
  std::size_t num_different = 0;
  for (std::size_t i = 0; i < ours.size() / 2; ++i) {
    ASSERT_LE(std::abs(pixel(ours, i) - pixel(theirs, i)), 1) << "node " << i;
    num_different += pixel(ours, i) != pixel(theirs, i);
  }
  EXPECT_LT(num_different, 200u);
}

TEST(Geoid, RewritesADamagedOrTruncatedCacheAndKeepsAGoodOne) {
  NEEDS_GRID();
  const test::ScratchFolder scratch;
  const fs::path cache = scratch / "a" / "b";
  const double expected = Geoid::egm96(kGtx, cache)->undulation_m(42.5, 1.5);
  const fs::path file = cache / "egm96-15.pgm";
  const std::string good = bytes_of(file);
  ASSERT_GT(good.size(), 2000000u);

  std::string flipped = good;
  flipped[good.size() / 2] = static_cast<char>(flipped[good.size() / 2] ^ 0x10);
  for (const std::string& bad : {flipped, good.substr(0, 1000), std::string(), good + "x"}) {
    write_bytes(file, bad);
    EXPECT_EQ(Geoid::egm96(kGtx, cache)->undulation_m(42.5, 1.5), expected);
    EXPECT_EQ(bytes_of(file), good);
  }
  const auto written = fs::last_write_time(file);
  Geoid::egm96(kGtx, cache);
  EXPECT_EQ(fs::last_write_time(file), written);
  EXPECT_EQ(std::distance(fs::directory_iterator(cache), {}), 1);  // nothing is left beside it
}

TEST(Geoid, RefusesAMissingTruncatedOrForeignGrid) {
  NEEDS_GRID();
  const test::ScratchFolder scratch;
  EXPECT_EQ(kind_of_failure(scratch / "none.gtx", scratch.path()), core::ErrorKind::Io);
  const std::string good = bytes_of(kGtx);
  const auto refused_as = [&](const std::string& bytes) {
    write_bytes(scratch / "bad.gtx", bytes);
    return kind_of_failure(scratch / "bad.gtx", scratch / "cache");
  };
  EXPECT_EQ(refused_as(good.substr(0, good.size() - 1)), core::ErrorKind::Input);
  EXPECT_EQ(refused_as(good.substr(0, 20)), core::ErrorKind::Input);
  EXPECT_EQ(refused_as(""), core::ErrorKind::Input);
  std::string other_rows = good;
  other_rows[35] = 7;
  EXPECT_EQ(refused_as(other_rows), core::ErrorKind::Input);
  std::string nan_west = good;
  nan_west.replace(8, 8, 8, '\xff');
  EXPECT_EQ(refused_as(nan_west), core::ErrorKind::Input);
  std::string nan_height = good;
  nan_height.replace(40 + 4 * 5000, 4, 4, '\xff');
  EXPECT_EQ(refused_as(nan_height), core::ErrorKind::Input);
  EXPECT_FALSE(fs::exists(scratch / "cache"));
}

TEST(Geoid, RefusesACacheThatIsNoFolder) {
  NEEDS_GRID();
  const test::ScratchFolder scratch;
  write_bytes(scratch / "file", "x");
  try {
    Geoid::egm96(kGtx, scratch / "file");
    FAIL();
  } catch (const core::Error& error) {
    EXPECT_EQ(error.kind(), core::ErrorKind::Io) << error.what();
  }
}

TEST(Geoid, RefusesAPlaceThatIsNone) {
  NEEDS_GRID();
  const test::ScratchFolder scratch;
  const auto geoid = Geoid::egm96(kGtx, scratch.path());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(geoid->undulation_m(90.5, 0.0), core::Error);
  EXPECT_THROW(geoid->undulation_m(nan, 0.0), core::Error);
  EXPECT_THROW(geoid->undulation_m(0.0, nan), core::Error);
}

TEST(Geoid, ManyThreadsGetTheSameBits) {
  NEEDS_GRID();
  const test::ScratchFolder scratch;
  const auto geoid = Geoid::egm96(kGtx, scratch.path());
  const auto all = [&] {
    std::vector<double> values;
    for (std::uint64_t i = 0; i < 20000; ++i)
      values.push_back(geoid->undulation_m(core::random_between(-90, 90, 3, 1, i),
                                           core::random_between(-180, 360, 3, 2, i)));
    return values;
  };
  const std::vector<double> alone = all();
  std::vector<std::vector<double>> together(4);
  {
    std::vector<std::jthread> threads;
    for (auto& result : together) threads.emplace_back([&] { result = all(); });
  }
  for (const auto& result : together) EXPECT_EQ(result, alone);
}

TEST(VerticalDatum, NamesGoBothWays) {
  for (const VerticalDatum datum : {VerticalDatum::Ellipsoid, VerticalDatum::Egm96})
    EXPECT_EQ(vertical_datum_from_name(name_of(datum)), datum);
  try {
    vertical_datum_from_name("navd88");
    FAIL();
  } catch (const core::Error& error) {
    EXPECT_EQ(error.kind(), core::ErrorKind::Config);
    EXPECT_NE(error.message().find("egm96"), std::string::npos);
  }
}

}  // namespace
}  // namespace terracast::geo
