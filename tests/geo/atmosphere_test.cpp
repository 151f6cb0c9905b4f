#include "geo/atmosphere.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"

/// The standard atmosphere against its published tables.
namespace terracast::geo {
namespace {

struct PublishedPressure {
  double height_m, pressure_pa;
};

TEST(Atmosphere, HasThePressuresOfIsosTable) {
  // By geopotential height: ISO 2533's table, which ICAO's Doc 7488 and the U.S. Standard Atmosphere 1976 share.
  for (const auto& [height_m, pressure_pa] : {PublishedPressure{-1000.0, 113929.0},
                                              {0.0, 101325.0},
                                              {1000.0, 89874.6},
                                              {5000.0, 54019.9},
                                              {11000.0, 22632.0},
                                              {20000.0, 5474.88},
                                              {32000.0, 868.018},
                                              {47000.0, 110.906},
                                              {51000.0, 66.9388},
                                              {71000.0, 3.95642}})
    EXPECT_NEAR(air_pressure_pa(height_m, {}) / pressure_pa, 1.0, 1e-5) << height_m;
}

TEST(Atmosphere, FollowsFromHeightsAboveSeaLevel) {
  // By geometric height, of the U.S. Standard Atmosphere 1976.
  for (const auto& [height_m, pressure_pa] :
       {PublishedPressure{5000.0, 54048.0}, {10000.0, 26500.0}, {30000.0, 1197.0}})
    EXPECT_NEAR(air_pressure_pa(geopotential_height_m(height_m), {}) / pressure_pa, 1.0, 1e-4)
        << height_m;
}

TEST(Atmosphere, HasTheTemperaturesAndDensitiesOfIsosTable) {
  // By geopotential height: kelvins, kilograms a cubic metre. Densities to the table's five digits.
  struct Published {
    double height_m, temperature_k, density_kg_per_m3;
  };
  for (const auto& [height_m, temperature_k, density_kg_per_m3] : {Published{0.0, 288.15, 1.2250},
                                                                   {1000.0, 281.65, 1.1116},
                                                                   {5000.0, 255.65, 0.73612},
                                                                   {11000.0, 216.65, 0.36392}}) {
    EXPECT_NEAR(air_temperature_k(height_m, {}), temperature_k, 1e-9) << height_m;
    EXPECT_NEAR(air_density_kg_per_m3(height_m, {}) / density_kg_per_m3, 1.0, 5e-5) << height_m;
  }
  EXPECT_NEAR(air_temperature_k(1000.0, {.warmer_k = 12.0}), 293.65, 1e-9);
}

TEST(Atmosphere, IsInHydrostaticBalance) {
  // dp/dH = -g p / (R T), of any day's air: by central differences, within each layer.
  for (const double warmer_k : {0.0, -20.0, 15.0})
    for (const double height_m : {100.0, 7000.0, 15000.0, 25000.0, 40000.0, 60000.0}) {
      const Air air{.sea_level_pressure_pa = 99000.0, .warmer_k = warmer_k};
      const double t = warmer_k + (height_m < 11000.0   ? 288.15 - 0.0065 * height_m
                                   : height_m < 20000.0 ? 216.65
                                   : height_m < 32000.0 ? 216.65 + 1e-3 * (height_m - 20000.0)
                                   : height_m < 47000.0 ? 228.65 + 2.8e-3 * (height_m - 32000.0)
                                                        : 270.65 - 2.8e-3 * (height_m - 51000.0));
      const double slope =
          std::log(air_pressure_pa(height_m + 1.0, air) / air_pressure_pa(height_m - 1.0, air)) /
          2.0;
      EXPECT_NEAR(slope / (-9.80665 / (287.05287 * t)), 1.0, 1e-7) << height_m;
    }
  EXPECT_EQ(air_pressure_pa(0.0, {.sea_level_pressure_pa = 98765.0, .warmer_k = 9.0}), 98765.0);
}

TEST(Atmosphere, EndsWhereItIsNotDefined) {
  for (const double height_m : {-5001.0, 80001.0, std::nan("")})
    EXPECT_THROW(air_pressure_pa(height_m, {}), core::Error) << height_m;
}

}  // namespace
}  // namespace terracast::geo
