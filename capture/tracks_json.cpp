#include "capture/tracks_json.h"

#include <utility>

#include "capture/json_parts.h"
#include "core/error.h"

namespace terracast::capture {

using core::ErrorKind;
using core::fail;
using core::Json;

Json json_from_tracks(const std::vector<TrackPoint>& tracks) {
  Json list = Json::array();
  for (const TrackPoint& track : tracks)
    list.push(Json::object()
                  .set("id", track.id)
                  .set("point_world_m", json_from_vector(track.point_world)));
  Json json = header();
  json.set("tracks", std::move(list));
  core::add_content_hash(json);
  return json;
}

std::vector<TrackPoint> tracks_from_json(const Json& json, const std::string& file) {
  const Source source{file};
  source.format(json);
  const Json& list = json.at("tracks");
  if (!list.is_array()) fail(ErrorKind::Input, "{}: tracks must be a list", file);
  std::vector<TrackPoint> tracks;
  tracks.reserve(list.size());
  for (std::size_t i = 0; i < list.size(); ++i) {
    tracks.push_back(
        {.id = list.at(i).at("id").integer(),
         .point_world = source.vector(list.at(i).at("point_world_m"), "point_world_m")});
    if (i > 0 && tracks[i - 1].id >= tracks[i].id)
      fail(ErrorKind::Input, "{}: track ids must ascend: {} comes before {}", file,
           tracks[i - 1].id, tracks[i].id);
  }
  source.whole(json);
  return tracks;
}

}  // namespace terracast::capture
