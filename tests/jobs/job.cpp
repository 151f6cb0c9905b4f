#include "tests/jobs/job.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tests/jobs/draws.h"
#include "tests/jobs/recorded_flight.h"
#include "tests/jobs/rigs.h"

namespace terracast::test {

namespace {

struct Place {
  double east_m = 0.0;
  double north_m = 0.0;
};

std::string at(const Place& place, double height_m) {
  return fmt::format("{{east_m = {:.2f}, north_m = {:.2f}, height_m = {:.2f}, above = \"ground\"}}",
                     place.east_m, place.north_m, height_m);
}

/// A flight, and where it is.
struct Flight {
  std::string text;
  Place start;
  double agl_m = 100.0;
  double speed_mps = 10.0;
  double heading_deg = 0.0;
  std::string log;  ///< of one that is recorded: "log.csv"
};

const JobWorld& draw_world(Draws draws) {
  const std::span<const JobWorld> worlds = job_worlds();
  double sum = 0.0;
  for (const JobWorld& world : worlds) sum += world.weight;
  double at_weight = sum * draws.unit();
  for (const JobWorld& world : worlds) {
    if (at_weight < world.weight) return world;
    at_weight -= world.weight;
  }
  return worlds.back();
}

/// From two metres to twelve kilometres above the ground, mostly as drones and aeroplanes fly.
double draw_agl_m(Draws& draws, const JobWorld& world) {
  const double agl_m = draws.chance(0.15)   ? draws.log_between(2.0, 20.0)
                       : draws.chance(0.75) ? draws.log_between(20.0, 500.0)
                                            : draws.log_between(500.0, 12000.0);
  return std::clamp(agl_m, world.least_agl_m, world.most_agl_m);
}

JobSize draw_job_size(Draws draws, JobExtent extent) {
  JobSize size;
  size.num_frames = static_cast<int>(draws.log_between(2.0, 61.0));
  size.color_samples = draws.among({1, 1, 2, 4, 4, 8, 16});
  size.rays = draws.log_between(2e5, 8e6);
  size.frame_s = 1.0 / draws.log_between(0.1, 30.0);
  switch (extent) {
    case JobExtent::Whole:
      break;
    case JobExtent::Small:
      size.num_frames = std::min(size.num_frames, 10);
      size.rays *= 0.1;
      break;
    case JobExtent::Quick:
      size.num_frames = std::min(size.num_frames, 5);
      size.rays *= 0.03;
      break;
  }
  return size;
}

Flight draw_flight(Draws draws, const JobWorld& world, const JobSize& size) {
  Flight flight;
  flight.start = {draws.both_ways(world.reach_m), draws.both_ways(world.reach_m)};
  flight.agl_m = draw_agl_m(draws, world);
  flight.heading_deg = draws.between(0.0, 360.0);
  const double time_s = size.frame_s * size.num_frames;
  // Most fly so that neighbouring frames share ground; some do not.
  const double step_m = flight.agl_m * draws.log_between(0.002, draws.chance(0.2) ? 1.5 : 0.2);
  flight.speed_mps =
      std::clamp(step_m / size.frame_s, 0.05, std::min(250.0, 0.5 * world.reach_m / time_s));
  const double way_m = flight.speed_mps * time_s;
  const double h = flight.agl_m;
  enum Kind { kStraight, kTurning, kForward, kHover, kOrbit, kLoop, kExplore, kSurvey, kRecorded };
  int kind = draws.weighted({2.0, 2.0, 2.0, 1.0, 2.0, 1.0, 0.5, 0.5});
  // Its own draws, so that the other flights stay what they were.
  Draws of_log(draws.seed(), "recorded flight");
  if (of_log.chance(0.15) && flight.speed_mps < 30.0) kind = kRecorded;
  if (kind == kExplore && (way_m > 1500.0 || flight.speed_mps > 40.0 || h > 600.0)) kind = kTurning;
  if (kind == kSurvey && (h < 30.0 || h > 600.0)) kind = kStraight;
  const double heading = flight.heading_deg * 3.14159265358979 / 180.0;
  const auto along = [&](double forward_m, double left_m) {
    return Place{flight.start.east_m + forward_m * std::sin(heading) - left_m * std::cos(heading),
                 flight.start.north_m + forward_m * std::cos(heading) + left_m * std::sin(heading)};
  };
  std::string& text = flight.text;
  text = fmt::format("name = \"P000\"\nrate_hz = {:.6f}\nnum_frames = {}\n", 1.0 / size.frame_s,
                     size.num_frames);
  if (kind != kSurvey && kind != kRecorded)
    text += fmt::format("speed_mps = {:.4f}\n", flight.speed_mps);
  switch (kind) {
    case kStraight: {
      const double length_m = std::max(1.3 * way_m, 20.0);
      text += fmt::format("kind = \"waypoints\"\nwaypoints = [{}, {}]\n", at(along(0.0, 0.0), h),
                          at(along(length_m, 0.0), h * draws.between(0.9, 1.2)));
      break;
    }
    case kTurning: {
      const double leg_m = std::max(0.5 * way_m, 20.0);
      text += fmt::format("kind = \"waypoints\"\nwaypoints = [{}, {}, {}, {}]\n",
                          at(along(0.0, 0.0), h), at(along(leg_m, 0.2 * leg_m), h),
                          at(along(1.9 * leg_m, draws.both_ways(0.8) * leg_m), h),
                          at(along(3.0 * leg_m, 0.0), h));
      break;
    }
    case kForward:
      text += fmt::format(
          "kind = \"forward\"\nstart = {}\nheading_deg = {:.3f}\nlength_m = {:.2f}\nsway_side_m = "
          "{:.3f}\n"
          "sway_height_m = {:.3f}\n",
          at(flight.start, h), flight.heading_deg, std::max(1.3 * way_m, 20.0),
          std::min(0.05 * h, 0.2 * flight.speed_mps), std::min(0.02 * h, 0.1 * flight.speed_mps));
      break;
    case kHover: {
      // Round a spot within its own length, by at most half a radian from frame to frame.
      const double radius_m = std::max(0.01 * h, 1.0);
      flight.speed_mps = std::min(flight.speed_mps, 0.5 * radius_m / size.frame_s);
      text = fmt::format("name = \"P000\"\nrate_hz = {:.6f}\nnum_frames = {}\nspeed_mps = {:.4f}\n",
                         1.0 / size.frame_s, size.num_frames, flight.speed_mps);
      text += fmt::format(
          "kind = \"orbit\"\ncentre = {}\nradius_m = {:.3f}\nface = \"centre\"\nlaps = {:.4f}\n",
          at(flight.start, h), radius_m, flight.speed_mps * time_s / (6.0 * radius_m) + 0.1);
      break;
    }
    case kOrbit: {
      const double radius_m = std::max(way_m / draws.between(0.5, 8.0), 5.0);
      text += fmt::format(
          "kind = \"orbit\"\ncentre = {}\nradius_m = {:.3f}\nface = \"{}\"\ndirection = "
          "\"{}\"\nlaps = {:.4f}\n",
          at(flight.start, h), radius_m, draws.among({"forward", "centre"}),
          draws.among({"left", "right"}), way_m / (6.0 * radius_m) + 0.1);
      break;
    }
    case kLoop: {
      // Half a radian from frame to frame at most, as when it hovers: rolling shutters see a point at several times else.
      const double length_m = std::max({0.5 * way_m, 20.0, 4.0 * flight.speed_mps * size.frame_s});
      text += fmt::format(
          "kind = \"loop\"\nstart = {}\nheading_deg = {:.3f}\nlength_m = {:.2f}\nwidth_m = {:.2f}\n"
          "height_change_m = {:.2f}\nroundness = {:.2f}\nlaps = 3.0\n",
          at(flight.start, h), flight.heading_deg, length_m, 0.6 * length_m,
          std::min(0.1 * h, 10.0), draws.unit());
      break;
    }
    case kRecorded: {
      flight.log = draw_log(of_log, {.frame_s = size.frame_s,
                                     .duration_s = time_s,
                                     .speed_mps = flight.speed_mps,
                                     .climb_m = 0.3 * h});
      text += fmt::format(
          "kind = \"recorded\"\nfile = \"log.csv\"\nformat = \"csv\"\nframe = \"local\"\n"
          "place_columns = [\"x\", \"y\", \"z\"]\norigin = {}\nmax_gap_s = {:.3f}\n",
          at(flight.start, h), 100.0 * size.frame_s);
      if (of_log.chance(0.5)) text += "attitude_columns = [\"yaw\", \"pitch\", \"roll\"]\n";
      break;
    }
    case kExplore: {
      const double side_m = 500.0 + h;
      text += fmt::format(
          "kind = \"explore\"\nseed = {}\nlowest_agl_m = {:.2f}\nhighest_agl_m = {:.2f}\nmax_leg_m "
          "= {:.1f}\n"
          "area = [{{east_m = {:.1f}, north_m = {:.1f}}}, {{east_m = {:.1f}, north_m = {:.1f}}}, "
          "{{east_m = {:.1f}, north_m = {:.1f}}}]\n",
          1 + draws.below(1000000), h, 1.4 * h, side_m, flight.start.east_m - side_m,
          flight.start.north_m - side_m, flight.start.east_m + side_m,
          flight.start.north_m - side_m, flight.start.east_m, flight.start.north_m + side_m);
      break;
    }
    default: {
      const double side_m = 2.0 * h;
      text += fmt::format(
          "kind = \"survey\"\nheading_deg = {:.3f}\nprofile = \"{}\"\nheight_m = {:.2f}\noverlap = "
          "{:.2f}\n"
          "area = [{{east_m = {:.1f}, north_m = {:.1f}}}, {{east_m = {:.1f}, north_m = {:.1f}}}, "
          "{{east_m = {:.1f}, north_m = {:.1f}}}, {{east_m = {:.1f}, north_m = {:.1f}}}]\n",
          flight.heading_deg, draws.among({"level", "terrain"}), h, draws.between(0.6, 0.9),
          flight.start.east_m - side_m, flight.start.north_m - side_m, flight.start.east_m + side_m,
          flight.start.north_m - side_m, flight.start.east_m + side_m,
          flight.start.north_m + side_m, flight.start.east_m - side_m,
          flight.start.north_m + side_m);
    }
  }
  if (kind != kExplore && kind != kSurvey && kind != kRecorded)
    text +=
        fmt::format("terrain_following = true\nmax_climb_deg = 75.0\nfollow_length_m = {:.1f}\n",
                    std::clamp(0.5 * h, 20.0, 2000.0));
  text += fmt::format("min_agl_m = {:.2f}\n", (kind == kRecorded ? 0.3 : 0.6) * h);
  if (draws.chance(0.2)) text += "bank = \"none\"\n";
  if (draws.chance(0.2)) text += "pitch = \"level\"\n";
  return flight;
}

std::string draw_conditions(Draws draws, const JobSize& size) {
  std::string text =
      fmt::format("color_samples = {}\nvisibility_km = {:.2f}\nwater_visibility_m = {:.2f}\n",
                  size.color_samples, draws.log_between(1.0, 300.0), draws.log_between(0.5, 60.0));
  if (draws.chance(0.8))
    text += fmt::format("sun_azimuth_deg = {:.2f}\nsun_elevation_deg = {:.2f}\n",
                        draws.between(0.0, 360.0),
                        draws.chance(0.12) ? draws.between(-20.0, 0.0) : draws.between(2.0, 85.0));
  if (draws.chance(0.2)) text += fmt::format("exposure = {:.3f}\n", draws.log_between(0.3, 3.0));
  if (draws.chance(0.1)) text += "ambient_rays = 2\n";
  if (draws.chance(0.1))
    text += fmt::format(
        "[[media]]\nkind = \"exponential_haze\"\nvisibility_km = {:.3f}\nbase_m = "
        "{:.1f}\nscale_height_m = {:.1f}\n",
        draws.log_between(0.5, 20.0), draws.between(0.0, 500.0), draws.log_between(20.0, 500.0));
  return text;
}

/// Bodies that cross what the cameras look at.
std::vector<std::string> draw_movers(Draws draws, const JobWorld& world, const Flight& flight) {
  std::vector<std::string> movers;
  if (!draws.chance(0.3) || flight.agl_m > 400.0) return movers;
  const int count = 1 + draws.below(3);
  for (int i = 0; i < count; ++i) {
    const bool is_on_ground = world.is_land && draws.chance(0.6);
    const char* thing =
        is_on_ground
            ? draws.among({"hatchback", "person", "city_bus", "articulated_truck", "child", "van"})
            : draws.among({"helicopter", "light_aircraft", "quadcopter", "rescue_helicopter"});
    const double heading = (flight.heading_deg + draws.both_ways(60.0)) * 3.14159265358979 / 180.0;
    const double distance_m = flight.agl_m * draws.between(0.4, 2.0) + 10.0;
    const Place from{flight.start.east_m + distance_m * std::sin(heading),
                     flight.start.north_m + distance_m * std::cos(heading)};
    const double turn = draws.between(0.0, 6.28);
    const Place to{from.east_m + 400.0 * std::sin(turn), from.north_m + 400.0 * std::cos(turn)};
    const double height_m = is_on_ground ? 0.0 : std::max(0.5 * flight.agl_m, world.least_agl_m);
    movers.push_back(fmt::format(
        "name = \"body{}\"\nthing = \"{}\"\nkind = \"waypoints\"\nspeed_mps = {:.3f}\nwaypoints = "
        "[{}, {}]\n{}",
        i, thing,
        std::string(thing) == "person" || std::string(thing) == "child" ? 1.4
                                                                        : draws.between(2.0, 15.0),
        at(from, height_m), at(to, height_m), is_on_ground ? "" : "terrain_following = true\n"));
  }
  return movers;
}

std::vector<std::string> draw_traffic(Draws draws, const JobWorld& world, const Flight& flight) {
  std::vector<std::string> traffic;
  if (!world.has_roads || flight.agl_m > 300.0 || !draws.chance(0.4)) return traffic;
  traffic.push_back(fmt::format("seed = {}\namount = {:.2f}\nreach_m = 250.0\nmost = 40\n",
                                1 + draws.below(10000), draws.log_between(0.5, 8.0)));
  return traffic;
}

std::vector<std::string> draw_exports(Draws draws, const std::vector<JobRig>& rigs,
                                      int num_frames) {
  constexpr int kLeastImagesOfColmap = 3;
  std::vector<std::string> exports;
  std::vector<std::string> lenses;
  bool is_any_wrong = false;
  for (const JobRig& rig : rigs) {
    if (rig.has_lenses_of_colmap && rig.num_cameras * num_frames >= kLeastImagesOfColmap)
      lenses.push_back(fmt::format("\"{}\"", rig.name));
    is_any_wrong |= rig.has_errors;
  }
  const std::string belief =
      is_any_wrong && draws.chance(0.6) ? "calibration = \"believed\"\n" : "";
  const auto add = [&](const std::string& format, const std::string& keys) {
    exports.push_back(fmt::format("format = \"{}\"\n{}", format, keys));
  };
  if (draws.chance(0.7)) add("terracast", belief);
  if (!lenses.empty() && draws.chance(0.8))
    add("colmap", fmt::format("rigs = [{}]\n{}", fmt::join(lenses, ", "), belief));
  bool has_kitti = false, has_object = false, has_coco = false, has_air = false, has_air_v1 = false;
  for (const JobRig& rig : rigs) {
    const std::string of_rig = fmt::format("rig = \"{}\"\n", rig.name);
    if (rig.is_rectified_pair && !has_kitti) {
      has_kitti = true;
      const std::string pair = of_rig + "left = \"left\"\nright = \"right\"\n";
      if (draws.chance(0.8) && !rig.has_errors) add("kitti", pair + belief);
      if (draws.chance(0.8) && !rig.has_errors) add("kitti_raw", pair + belief);
    }
    if (rig.is_rectified_pair && !rig.has_rolling_shutter && !has_object && draws.chance(0.6)) {
      has_object = true;
      // Its files state rectified cameras as they are: none that are believed elsewhere.
      add("kitti_object", of_rig + "camera = \"left\"\n" + (rig.has_errors ? "" : belief));
    }
    if (rig.has_lenses_of_colmap && !has_coco && draws.chance(0.5)) {
      has_coco = true;
      add("coco", of_rig + fmt::format("categories = \"{}\"\n", draws.among({"coco", "own"})));
    }
    if (rig.is_of_tartanair && !has_air) {
      has_air = true;
      add("tartanair",
          of_rig + fmt::format("sky_depth_m = 1e6\nflow = \"{}\"\n", draws.among({"npz", "png"})));
    }
    if (rig.is_of_tartanair_v1 && !has_air_v1) {
      has_air_v1 = true;
      add("tartanair_v1", of_rig + "sky_depth_m = 1e6\n");
    }
  }
  if (exports.empty()) add("terracast", belief);
  return exports;
}

/// Formats of sensors beside cameras.
void add_sensor_exports(Draws draws, const std::vector<JobRig>& rigs,
                        std::vector<std::string>& exports) {
  std::vector<std::string> of_euroc;
  bool has_sensors = false;
  for (const JobRig& rig : rigs) {
    if (rig.has_lenses_of_euroc) of_euroc.push_back(fmt::format("\"{}\"", rig.name));
    has_sensors |= rig.has_sensors;
  }
  if (!has_sensors || of_euroc.empty()) return;
  const auto add = [&](const char* format, const char* keys) {
    if (draws.chance(0.5))
      exports.push_back(
          fmt::format("format = \"{}\"\nrigs = [{}]\n{}", format, fmt::join(of_euroc, ", "), keys));
  };
  const char* const belief = draws.chance(0.6) ? "calibration = \"believed\"\n" : "";
  add("mcap", belief);
  add("euroc", belief);
  add("tum", "");
}

/// "[\"@/rig0.toml\", \"@/rig1.toml\"]", the files added to the job.
std::string add_list(GeneratedJob& job, const std::string& stem,
                     const std::vector<std::string>& texts) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < texts.size(); ++i) {
    job.files.push_back({fmt::format("{}{}.toml", stem, i), texts[i]});
    names.push_back(fmt::format("\"@{}\"", job.files.back().name));
  }
  return fmt::format("[{}]", fmt::join(names, ", "));
}

}  // namespace

GeneratedJob generate_job(std::uint64_t seed, const JobChoice& choice) {
  GeneratedJob job;
  job.seed = seed;
  const JobWorld& world = draw_world(Draws(seed, "world"));
  if ((world.needs_data && !choice.has_data) ||
      (choice.extent != JobExtent::Whole && !world.is_formula))
    return job;
  job.world = &world;
  JobSize size = draw_job_size(Draws(seed, "size"), choice.extent);
  Draws draws(seed, "job");
  const int num_rigs = draws.chance(0.25) ? 2 : 1;
  size.rays /= num_rigs;
  std::vector<JobRig> rigs;
  std::vector<std::string> rig_texts;
  for (int i = 0; i < num_rigs; ++i) {
    rigs.push_back(draw_rig(fmt::format("rig{}", i), Draws(seed, fmt::format("rig {}", i)), size));
    rig_texts.push_back(rigs.back().text);
    // Formats that fix their cameras fix what a frame costs.
    const double frame_rays = rigs.back().num_cameras * rigs.back().pixels_per_camera;
    size.color_samples =
        std::clamp(static_cast<int>(8e6 / (2.0 * frame_rays)), 1, size.color_samples);
    size.num_frames = std::clamp(static_cast<int>(1e7 / (frame_rays * (1.0 + size.color_samples))),
                                 2, size.num_frames);
  }
  const Flight flight = draw_flight(Draws(seed, "flight"), world, size);
  const double cell_px = draws.log_between(1.5, 8.0);
  job.files.push_back({"conditions.toml", draw_conditions(Draws(seed, "conditions"), size)});
  const auto set = [&](const std::string& key, const std::string& value) {
    job.keys.push_back(key);
    job.values.push_back(value);
  };
  set("seed", fmt::format("{}", 1 + seed % 1000));
  set("validate.seed", fmt::format("{}", 1 + seed % 997));
  set("detail.cell_px", fmt::format("{:.3f}", cell_px));
  set("detail.finest_spacing_m", fmt::format("{:.1f}", draws.among({1.0, 1.0, 2.0, 4.0, 8.0})));
  set("tracks.num_points", fmt::format("{}", draws.among({2000, 4000, 4000, 8000})));
  set("rigs", add_list(job, "rig", rig_texts));
  set("trajectories", add_list(job, "flight", {flight.text}));
  if (!flight.log.empty()) job.files.push_back({"log.csv", flight.log});
  set("moving", add_list(job, "body", draw_movers(Draws(seed, "movers"), world, flight)));
  set("traffic", add_list(job, "traffic", draw_traffic(Draws(seed, "traffic"), world, flight)));
  set("conditions", "\"@conditions.toml\"");
  std::vector<std::string> exports = draw_exports(Draws(seed, "exports"), rigs, size.num_frames);
  add_sensor_exports(Draws(seed, "exports of sensors"), rigs, exports);
  set("exports", add_list(job, "export", exports));
  return job;
}

}  // namespace terracast::test
