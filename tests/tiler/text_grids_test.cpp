#include "tiler/text_grids.h"

#include <chrono>
#include <filesystem>
#include <fstream>

#include "core/stop.h"
#include "tests/tiler/raster_files.h"
#include "tiler/raster_source.h"

// Grids of text have no places of rows: one that ends too early is an error, and no search without end.
namespace terracast::test {
namespace {

using core::ErrorKind;

constexpr const char* kWgs84 =
    "GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\",SPHEROID[\"WGS 84\",6378137,298.257223563]],"
    "PRIMEM[\"Greenwich\",0],UNIT[\"degree\",0.0174532925199433]]";

constexpr int kColumns = 60;
constexpr int kRows = 120;

std::string number(int row, int column) {
  return std::to_string(500 + row) + "." + std::to_string(column % 10);
}

/// Rows from the north; only the first `num_rows` are there.
std::string rows(int num_rows, bool is_upwards = false) {
  std::string text;
  for (int k = 0; k < num_rows; ++k) {
    const int row = is_upwards ? kRows - 1 - k : k;
    for (int column = 0; column < kColumns; ++column) text += number(row, column) + " ";
    text += "\n";
  }
  return text;
}

struct TextGrid {
  const char* name;
  std::function<std::string(int num_rows)> text;
};

// About latitude 42.5, longitude 1.5: 0.001 degrees a cell.
const TextGrid kGrids[] = {
    {"grid.asc",
     [](int num_rows) {
       return "ncols 60\nnrows 120\nxllcorner 1.47\nyllcorner 42.44\ncellsize 0.001\n"
              "NODATA_value -9999\n" +
              rows(num_rows);
     }},
    {"surfer.grd",
     [](int num_rows) {
       return "DSAA\n60 120\n1.4705 1.5295\n42.4405 42.5595\n500 619.9\n" + rows(num_rows, true);
     }},
    {"grass.txt",
     [](int num_rows) {
       return "north: 42.56\nsouth: 42.44\neast: 1.53\nwest: 1.47\nrows: 120\ncols: 60\n" +
              rows(num_rows);
     }},
};

tiler::WorldOptions world_over(const std::filesystem::path& file) {
  tiler::WorldOptions options = world_of_rasters({file}, 2048.0);
  options.detail_roughness = 0.0;
  return options;
}

std::filesystem::path write_grid(const ScratchFolder& folder, const TextGrid& grid, int num_rows) {
  std::ofstream(folder / grid.name) << grid.text(num_rows);
  const auto file = folder / grid.name;
  std::ofstream(std::filesystem::path(file).replace_extension(".prj")) << kWgs84;
  return file;
}

TEST(TextGrids, WholeOnesAreRead) {
  const ScratchFolder folder;
  const auto file = write_grid(folder, kGrids[0], kRows);
  // Row 59 has its centre at 42.5005, 59.5 rows below 42.56.
  EXPECT_NEAR(prepare(world_over(file))->measured_height_m(42.5, 1.5005).value(), 500.0 + 59.5,
              0.5);
}

TEST(TextGrids, CutOffOnesAreErrorsAtOnce) {
  const ScratchFolder folder;
  for (const TextGrid& grid : kGrids)
    for (const int num_rows : {1, 60, 80, 119}) {
      SCOPED_TRACE(std::string(grid.name) + " of " + std::to_string(num_rows) + " rows");
      const auto file = write_grid(folder, grid, num_rows);
      const auto begin = std::chrono::steady_clock::now();
      expect_error(ErrorKind::Input,
                   {grid.name, "row " + std::to_string(num_rows + 1) + " of 120", "truncated"},
                   [&] { prepare(world_over(file)); });
      // Forty missing rows would take days: 2^40 reads.
      EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(20));
    }
}

void write_vrt_of_grid(const ScratchFolder& folder) {
  std::ofstream(folder / "grid.vrt")
      << "<VRTDataset rasterXSize=\"60\" rasterYSize=\"120\"><SRS>EPSG:4326</SRS><GeoTransform>"
         "1.47, 0.001, 0, 42.56, 0, -0.001</GeoTransform><VRTRasterBand dataType=\"Float64\" "
         "band=\"1\"><SimpleSource><SourceFilename relativeToVRT=\"1\">grid.asc</SourceFilename>"
         "<SourceBand>1</SourceBand></SimpleSource></VRTRasterBand></VRTDataset>";
}

TEST(TextGrids, CutOffOnesInAVrtAreErrorsToo) {
  const ScratchFolder folder;
  write_grid(folder, kGrids[0], 60);
  write_vrt_of_grid(folder);
  expect_error(ErrorKind::Input, {"grid.vrt", "grid.asc", "row 61 of 120"},
               [&] { prepare(world_over(folder / "grid.vrt")); });
}

// What was found of a file counts for as long as it stays as it is.
TEST(TextGrids, OnesInAVrtAreLookedAtAgainOnceTheyChange) {
  const ScratchFolder folder;
  write_vrt_of_grid(folder);
  const auto write_old = [&](int num_rows) {
    const auto file = write_grid(folder, kGrids[0], num_rows);
    std::filesystem::last_write_time(
        file, std::filesystem::file_time_type::clock::now() - std::chrono::hours(1));
  };
  for (int i = 0; i < 2; ++i) {
    write_old(kRows);
    for (int k = 0; k < 2; ++k)
      EXPECT_NEAR(prepare(world_over(folder / "grid.vrt"))->measured_height_m(42.5, 1.5005).value(),
                  500.0 + 59.5, 0.5);
    write_old(60);
    for (int k = 0; k < 2; ++k)
      expect_error(ErrorKind::Input, {"grid.vrt", "grid.asc", "row 61 of 120"},
                   [&] { prepare(world_over(folder / "grid.vrt")); });
  }
}

TEST(TextGrids, AStopIsHeeded) {
  const ScratchFolder folder;
  const auto file = write_grid(folder, kGrids[0], kRows);
  core::ask_to_stop();
  expect_error(ErrorKind::Interrupted, {}, [&] {
    tiler::RasterSource::open({.written = "grid.asc", .resolved = file},
                              world_over(file).elevation[0],
                              {.lat_deg = kOriginLat_deg, .lon_deg = kOriginLon_deg});
  });
  core::forget_stop();
}

// GDAL takes the type of numbers from the first hundred kilobytes: decimals behind that were cut off.
TEST(TextGrids, DecimalsBehindManyWholeNumbersCount) {
  const ScratchFolder folder;
  std::ofstream grid(folder / "grid.asc");
  grid << "ncols 400\nnrows 400\nxllcorner 1.4\nyllcorner 42.4\ncellsize 0.0005\n";
  for (int row = 0; row < 400; ++row)
    for (int column = 0; column < 400; ++column)
      grid << (row < 190 ? "500" : "500.75") << (column == 399 ? "\n" : " ");
  grid.close();
  std::ofstream(folder / "grid.prj") << kWgs84;
  // Row 200 lies at 42.5.
  EXPECT_NEAR(prepare(world_over(folder / "grid.asc"))->measured_height_m(42.499, 1.5).value(),
              500.75, 1e-9);
}

}  // namespace
}  // namespace terracast::test
