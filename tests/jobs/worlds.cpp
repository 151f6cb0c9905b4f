#include "tests/jobs/worlds.h"

#include <fmt/format.h>

#include <vector>

namespace terracast::test {

namespace {

std::string elevation(const std::string& kind, const std::string& keys) {
  return fmt::format(
      "\n[[elevation]]\nkind = \"{}\"\nlicence = \"generated; free of rights\"\naccuracy = "
      "\"exact: generated\"\n{}",
      kind, keys);
}

/// Ground of a formula, 8 km wide.
JobWorld bare(const std::string& name, double lat_deg, double lon_deg, const std::string& ground) {
  JobWorld world;
  world.name = name;
  world.text = fmt::format(
                   "name = \"{}\"\norigin_lat_deg = {}\norigin_lon_deg = {}\nsize_m = "
                   "8192.0\noutside = \"extend\"\n",
                   name, lat_deg, lon_deg) +
               ground;
  world.reach_m = 1500.0;
  world.most_agl_m = 3000.0;
  world.is_formula = true;
  return world;
}

/// Ground of a landform from a seed, without anything on it.
JobWorld landform(const std::string& form, int seed, double lat_deg, bool is_land) {
  JobWorld world;
  world.name = fmt::format("{}_{}", form, seed);
  world.text =
      fmt::format(
          "name = \"{}\"\norigin_lat_deg = {}\norigin_lon_deg = 11.0\nsize_m = 25600.0\nseed = "
          "{}\noutside = \"{}\"\n",
          world.name, lat_deg, seed, is_land ? "extend" : "sea") +
      elevation("procedural", fmt::format("vertical_datum = \"egm96\"\nlandform = "
                                          "\"{}\"\nhas_coast = {}\nlakes = {}\nrelief_m = {}\n",
                                          form, !is_land, is_land ? 2 : 0,
                                          form == "plains" ? 150 : 1200 + 200 * seed)) +
      "\n[[layer]]\nkind = \"land_cover\"\nsource = \"derived\"\nlicence = \"generated; free of "
      "rights\"\n"
      "accuracy = \"exact: generated\"\n";
  world.reach_m = 9000.0;
  world.most_agl_m = 12000.0;
  world.is_land = is_land;
  return world;
}

JobWorld shipped(const std::string& name, double reach_m, bool is_land) {
  JobWorld world;
  world.name = name;
  world.text = fmt::format("extends = \"@CONFIGS@/worlds/{}.toml\"\n", name);
  world.reach_m = reach_m;
  world.most_agl_m = 12000.0;
  world.is_land = is_land;
  return world;
}

/// With houses, woods and masts, which flights keep above.
JobWorld settled(const std::string& name, double reach_m, bool is_land) {
  JobWorld world = shipped(name, reach_m, is_land);
  world.weight = 1.5;
  world.least_agl_m = 60.0;
  world.has_roads = true;
  return world;
}

JobWorld of_data(JobWorld world) {
  world.needs_data = true;
  return world;
}

std::vector<JobWorld> make_worlds() {
  const auto fractal = [](double relief_m) {
    return elevation("fractal",
                     fmt::format("vertical_datum = \"ellipsoid\"\nrelief_m = {}\n", relief_m));
  };
  const auto at_height = [](const std::string& keys) {
    return "vertical_datum = \"ellipsoid\"\nheight_m = 120.0\n" + keys;
  };
  // Its relief takes minutes of tiles.
  JobWorld rough_hills = bare("rough_hills", 28.0, 86.5, fractal(700.0));
  rough_hills.is_formula = false;
  return {
      bare("plane", 0.1, 0.1, elevation("plane", at_height(""))),
      bare("ramp", -33.0, 151.0, elevation("ramp", at_height("slope = 0.22\n"))),
      bare("bowl", 64.0, -21.0, elevation("paraboloid", at_height("curvature_per_m = 0.0003\n"))),
      bare("hills", 46.0, 7.0, fractal(150.0)),
      rough_hills,
      bare("smooth_hills", 5.0, 100.0, "detail_roughness = 0.0\n" + fractal(60.0)),
      landform("coast", 1, 43.0, false),
      landform("coast", 2, 60.0, false),
      landform("islands", 1, 10.0, false),
      landform("islands", 2, 37.0, false),
      landform("plains", 1, 52.0, true),
      landform("plains", 2, -20.0, true),
      landform("valleys", 1, 46.0, true),
      landform("valleys", 2, 68.0, true),
      shipped("procedural", 18000.0, false),
      settled("town", 2000.0, true),
      settled("plains", 18000.0, true),
      settled("archipelago", 9000.0, false),
      settled("alpine", 15000.0, true),
      of_data(shipped("zion", 10000.0, true)),
      of_data(shipped("pennsylvania", 13000.0, true)),
      of_data(shipped("slovenia", 400.0, true)),
      of_data(shipped("alexandria", 2000.0, true)),
      of_data(shipped("andorra", 15000.0, true)),
      of_data(shipped("monaco", 12000.0, false)),
      of_data(settled("andorra_settled", 8000.0, true)),
      of_data(settled("monaco_settled", 4000.0, false)),
      of_data(settled("bilbao_settled", 3000.0, false)),
  };
}

}  // namespace

std::span<const JobWorld> job_worlds() {
  static const std::vector<JobWorld> worlds = make_worlds();
  return worlds;
}

}  // namespace terracast::test
