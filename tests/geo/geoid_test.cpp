#include "geo/geoid.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>
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
  const terracast::test::ScratchFolder scratch;
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
  const terracast::test::ScratchFolder scratch;
  const auto geoid = Geoid::egm96(kGtx, scratch.path());
  std::ifstream table(terracast::test::shared_data() / "geoid" / "egm96_test_points.csv");
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
  const terracast::test::ScratchFolder scratch;
  Geoid::egm96(kGtx, scratch.path());
  const std::string ours = pixels_of(scratch / "egm96-15.pgm");
  const std::string theirs = pixels_of(terracast::test::shared_data() / "geoid" / "egm96-15.pgm");
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
  const terracast::test::ScratchFolder scratch;
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
  const terracast::test::ScratchFolder scratch;
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
  const terracast::test::ScratchFolder scratch;
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
  const terracast::test::ScratchFolder scratch;
  const auto geoid = Geoid::egm96(kGtx, scratch.path());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(geoid->undulation_m(90.5, 0.0), core::Error);
  EXPECT_THROW(geoid->undulation_m(nan, 0.0), core::Error);
  EXPECT_THROW(geoid->undulation_m(0.0, nan), core::Error);
}

TEST(Geoid, ManyThreadsGetTheSameBits) {
  NEEDS_GRID();
  const terracast::test::ScratchFolder scratch;
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

/// GEOTRANS's grid of EGM2008, made here: undulations of a closed form, big-endian.
std::string geotrans_grid(const std::function<double(double lat_deg, double lon_deg)>& value_m) {
  constexpr int kRim = 9;
  std::string bytes;
  const auto append = [&](std::uint64_t bits, int count) {
    for (int shift = 8 * (count - 1); shift >= 0; shift -= 8)
      bytes.push_back(static_cast<char>((bits >> shift) & 0xff));
  };
  append(kRim, 4);
  append(4321, 4);
  append(8640, 4);
  append(std::bit_cast<std::uint64_t>(2.5 / 60.0), 8);
  append(std::bit_cast<std::uint64_t>(2.5 / 60.0), 8);
  for (int row = -kRim; row < 4321 + kRim; ++row)
    for (int column = -kRim; column < 8641 + kRim; ++column)
      append(std::bit_cast<std::uint32_t>(
                 static_cast<float>(value_m(90.0 - row / 24.0, column / 24.0))),
             4);
  return bytes;
}

TEST(Egm2008, ImportsTheGridOfGeotrans) {
  const terracast::test::ScratchFolder scratch;
  // Within what GeographicLib's cubic takes exactly but for the rounding to 3 mm.
  const auto form_m = [](double lat_deg, double lon_deg) {
    return 20.0 * std::sin(lon_deg * M_PI / 180.0) * std::cos(lat_deg * M_PI / 180.0) -
           0.3 * lat_deg;
  };
  const std::string good = geotrans_grid(form_m);
  ASSERT_EQ(good.size(), 150285632u);  // the size of the file that GEOTRANS 3.7 ships
  write_bytes(scratch / "grid", good);
  const fs::path pgm = import_egm2008(scratch / "grid", scratch / "geoids");
  EXPECT_EQ(pgm.filename(), "egm2008-2_5.pgm");
  const auto geoid = Geoid::egm2008(pgm);
  for (const auto& [lat_deg, lon_deg] :
       {std::pair{42.51, 1.49}, {-33.3, 151.2}, {0.01, 359.99}, {71.0, -20.0}})
    EXPECT_NEAR(geoid->undulation_m(lat_deg, lon_deg), form_m(lat_deg, lon_deg), 0.004);

  {
    std::fstream file(pgm, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(40'000'000).put('\x7f');
  }
  try {
    Geoid::egm2008(pgm);
    ADD_FAILURE() << "a flipped byte is not found";
  } catch (const core::Error& error) {
    EXPECT_NE(std::string(error.what()).find("damaged"), std::string::npos) << error.what();
  }

  const auto refused = [&](const char* word) {
    try {
      import_egm2008(scratch / "grid", scratch / "none");
      ADD_FAILURE() << word;
    } catch (const core::Error& error) {
      EXPECT_EQ(error.kind(), core::ErrorKind::Input) << error.what();
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
  };
  const auto put = [&](std::size_t at, const std::string& bytes) {
    std::fstream file(scratch / "grid", std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(static_cast<std::streamoff>(at)).write(bytes.data(), std::ssize(bytes));
  };
  put(28 + 4 * (20 * 8659 + 100), std::string(4, '\xff'));
  refused("row 11, column 91");
  put(3, "\x08");
  refused("a rim of 8");
  fs::resize_file(scratch / "grid", good.size() - 4);
  refused("geotranz");
  fs::resize_file(scratch / "grid", 0);
  refused("geotranz");
  EXPECT_FALSE(fs::exists(scratch / "none" / "egm2008-2_5.pgm"));
}

// Where `terracast geoid import` has been run on GEOTRANS's own file.
TEST(Egm2008, MatchesNgaPublishedPoints) {
  std::shared_ptr<const Geoid> geoid;
  try {
    geoid = Geoid::egm2008();
  } catch (const core::Error& error) {
    GTEST_SKIP() << "skipped: " << error.what();
  }
  // Outputs that NGA published with its interpolation program of the 2.5-minute grid, tide free.
  for (const Published& point :
       {Published{37.0, 241.0, -26.151}, Published{37.0, -119.0, -26.151},
        Published{36.0, 242.983333, -29.171}, Published{90.0, 0.0, 14.899},
        Published{-90.0, 359.983333, -30.150}, Published{-90.0, 0.0, -30.150}})
    EXPECT_NEAR(geoid->undulation_m(point.lat_deg, point.lon_deg), point.undulation_m, 0.03)
        << point.lat_deg << " " << point.lon_deg;
}

OffsetGrid sloping_grid() {
  OffsetGrid grid;
  grid.name = "sloping.gtx";
  grid.south_deg = 40.0;
  grid.west_deg = 359.0;  // over Greenwich
  grid.lat_step_deg = 0.5;
  grid.lon_step_deg = 0.25;
  grid.num_rows = 5;
  grid.num_columns = 9;
  for (int j = 0; j < grid.num_rows; ++j)
    for (int i = 0; i < grid.num_columns; ++i) grid.offsets_m.push_back(10.0 * j + i);
  return grid;
}

TEST(OffsetGrids, AreBilinearAndCarriedOnBeyondTheirBorder) {
  const auto geoid = Geoid::from_grid(sloping_grid());
  EXPECT_NEAR(geoid->undulation_m(40.25, -0.875), 5.5, 1e-12);
  EXPECT_NEAR(geoid->undulation_m(40.25, 359.125), 5.5, 1e-12);
  EXPECT_NEAR(geoid->undulation_m(41.0, 0.5), 26.0, 1e-12);
  EXPECT_NEAR(geoid->undulation_m(60.0, 0.5), 46.0, 1e-12);
  EXPECT_TRUE(geoid->covers(42.0, 1.0));
  EXPECT_TRUE(geoid->covers(40.0, -1.0));
  EXPECT_FALSE(geoid->covers(42.1, 0.5));
  EXPECT_FALSE(geoid->covers(41.0, 1.1));
  OffsetGrid holed = sloping_grid();
  holed.offsets_m[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(Geoid::from_grid(holed)->covers(40.1, -0.9));
  EXPECT_TRUE(Geoid::from_grid(holed)->covers(40.6, -0.9));
}

TEST(OffsetGrids, ThatAreNoneAreRefused) {
  const auto refused = [](const std::function<void(OffsetGrid&)>& spoil) {
    OffsetGrid grid = sloping_grid();
    spoil(grid);
    try {
      Geoid::from_grid(grid);
      ADD_FAILURE();
    } catch (const core::Error& error) {
      EXPECT_EQ(error.kind(), core::ErrorKind::Input);
      EXPECT_NE(std::string(error.what()).find("sloping.gtx"), std::string::npos);
    }
  };
  refused([](OffsetGrid& grid) { grid.num_columns = 1; });
  refused([](OffsetGrid& grid) { grid.lat_step_deg = 0.0; });
  refused([](OffsetGrid& grid) { grid.offsets_m.pop_back(); });
  refused([](OffsetGrid& grid) { grid.offsets_m[3] = 4300.0; });
}

TEST(VerticalDatum, IsKnownByItsName) {
  EXPECT_TRUE(vertical_datum_from_name("ellipsoid").is_ellipsoid());
  EXPECT_EQ(vertical_datum_from_name("ellipsoid"), VerticalDatum{});
  for (const char* name : {"ellipsoid", "egm96", "egm2008"})
    EXPECT_NO_THROW(check_vertical_datum_name(name));
  try {
    vertical_datum_from_name("navd88");
    FAIL();
  } catch (const core::Error& error) {
    EXPECT_EQ(error.kind(), core::ErrorKind::Config);
    EXPECT_NE(error.message().find("egm96"), std::string::npos);
    EXPECT_NE(error.message().find("egm2008"), std::string::npos);
  }
}

}  // namespace
}  // namespace terracast::geo
