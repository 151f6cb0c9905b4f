#include "batch/dataset/sequence_summary.h"

#include <algorithm>
#include <cmath>

namespace terracast::batch {
namespace {

using core::Json;

/// The members of SequenceFacts that a capture tells, with their names; one list for both ways.
template <class Facts, class Visit>
void visit_facts(Facts& facts, const Visit& visit) {
  visit("run", facts.run);
  visit("sequence", facts.sequence);
  visit("world", facts.world);
  visit("frames", facts.num_frames);
  visit("cameras", facts.num_cameras);
  visit("utc_start", facts.utc_start);
  visit("duration_s", facts.duration_s);
  visit("track_length_m", facts.track_length_m);
  visit("lat_deg", facts.lat_deg);
  visit("lon_deg", facts.lon_deg);
  visit("south_deg", facts.south_deg);
  visit("north_deg", facts.north_deg);
  visit("west_deg", facts.west_deg);
  visit("east_deg", facts.east_deg);
  visit("lowest_m", facts.lowest_m);
  visit("highest_m", facts.highest_m);
  visit("ground_cells", facts.num_ground_cells);
}

template <class Facts, class Visit>
void visit_camera(Facts& camera, const Visit& visit) {
  visit("rig", camera.rig);
  visit("camera", camera.camera);
  visit("model", camera.model);
  visit("width_px", camera.width_px);
  visit("height_px", camera.height_px);
  visit("focal_x_px", camera.focal_x_px);
  visit("focal_y_px", camera.focal_y_px);
}

void take(const Json& json, std::string& value) { value = json.string(); }
void take(const Json& json, int& value) { value = static_cast<int>(json.integer()); }
void take(const Json& json, std::int64_t& value) { value = json.integer(); }
void take(const Json& json, double& value) { value = json.number(); }

Json json_from_place(const geo::Geodetic& place) {
  return Json::array_of({place.lat_deg, place.lon_deg, place.height_m});
}
geo::Geodetic place_from_json(const Json& json) {
  return {json.at(0).number(), json.at(1).number(), json.at(2).number()};
}

}  // namespace

SequenceSummary summary_of(const std::string& run, const capture::SequenceReader& sequence,
                           const world::WorldManifest& manifest, const GroundOptions& options,
                           const std::function<double(const geo::Geodetic&)>& height_above_ground) {
  SequenceSummary summary{.facts = sequence_facts(run, sequence),
                          .place = {.world = manifest.name,
                                    .ground = options.ground,
                                    .origin = manifest.origin,
                                    .size_m = manifest.size_m,
                                    .licences = sequence.info().licences},
                          .cameras = camera_facts(sequence.info()),
                          .track = {},
                          .speeds_mps = {},
                          .heights_m = {},
                          .ground = ground_seen(sequence, options)};
  summary.facts.num_ground_cells = summary.ground.num_cells();
  const geo::WorldFrame frame(manifest.origin);
  const auto& records = sequence.frames();
  const int count = std::min(kTrackPlaces, static_cast<int>(records.size()));
  for (int i = 0; i < count; ++i) {
    const auto& record = records[static_cast<std::size_t>(i) * (records.size() - 1) /
                                 static_cast<std::size_t>(std::max(1, count - 1))];
    summary.track.push_back(frame.geodetic_from_world(record.world_from_body.translation));
    summary.speeds_mps.push_back(record.velocity_world_mps.norm());
    const double height_m = height_above_ground(summary.track.back());
    if (std::isfinite(height_m)) summary.heights_m.push_back(height_m);
  }
  return summary;
}

Json json_from_summary(const SequenceSummary& summary) {
  Json facts = Json::object();
  visit_facts(summary.facts, [&](const char* name, const auto& value) { facts.set(name, value); });
  Json cameras = Json::array();
  for (const CameraFacts& camera : summary.cameras) {
    Json json = Json::object();
    visit_camera(camera, [&](const char* name, const auto& value) { json.set(name, value); });
    cameras.push(std::move(json));
  }
  Json track = Json::array();
  for (const geo::Geodetic& place : summary.track) track.push(json_from_place(place));
  Json json = Json::object();
  json.set("facts", std::move(facts))
      .set("place", Json::object()
                        .set("world", summary.place.world)
                        .set("ground", summary.place.ground)
                        .set("origin", json_from_place(summary.place.origin))
                        .set("size_m", summary.place.size_m)
                        .set("licences", Json::array_of(summary.place.licences)))
      .set("cameras", std::move(cameras))
      .set("track", std::move(track))
      .set("speeds_mps", Json::array_of(summary.speeds_mps))
      .set("heights_m", Json::array_of(summary.heights_m))
      .set("ground", json_from_ground(summary.ground));
  core::add_content_hash(json);
  return json;
}

SequenceSummary summary_from_json(const Json& json, const std::string& file) {
  return core::with_context(
      [&] {
        core::check_content_hash(json);
        SequenceSummary summary;
        visit_facts(summary.facts,
                    [&](const char* name, auto& value) { take(json.at("facts").at(name), value); });
        const Json& place = json.at("place");
        summary.place = {.world = place.at("world").string(),
                         .ground = place.at("ground").string(),
                         .origin = place_from_json(place.at("origin")),
                         .size_m = place.at("size_m").number(),
                         .licences = place.at("licences").strings()};
        for (std::size_t i = 0; i < json.at("cameras").size(); ++i)
          visit_camera(summary.cameras.emplace_back(), [&](const char* name, auto& value) {
            take(json.at("cameras").at(i).at(name), value);
          });
        for (std::size_t i = 0; i < json.at("track").size(); ++i)
          summary.track.push_back(place_from_json(json.at("track").at(i)));
        summary.speeds_mps = json.at("speeds_mps").numbers();
        summary.heights_m = json.at("heights_m").numbers();
        summary.ground = ground_from_json(json.at("ground"), file);
        return summary;
      },
      "reading " + file);
}

}  // namespace terracast::batch
