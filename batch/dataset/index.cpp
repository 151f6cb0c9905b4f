#include "batch/dataset/index.h"

#include <algorithm>
#include <array>

#include "core/printable.h"

namespace terracast::batch {

namespace {

using core::Json;
using core::printable;

std::vector<std::string> sorted_formats(const SequenceFacts& sequence) {
  std::vector<std::string> formats = sequence.formats;
  std::sort(formats.begin(), formats.end());
  return formats;
}

constexpr std::array kFields = {
    IndexField{"id", "sc:Text", false, "run/sequence",
               [](const SequenceFacts& s) { return Json(printable(s.id())); }},
    IndexField{"run", "sc:Text", false, "The run that made it.",
               [](const SequenceFacts& s) { return Json(printable(s.run)); }},
    IndexField{"sequence", "sc:Text", false, "Its name in the run.",
               [](const SequenceFacts& s) { return Json(printable(s.sequence)); }},
    IndexField{"swept", "sc:Text", false, "The keys of the config that the sweep gave its run.",
               [](const SequenceFacts& s) { return Json(printable(s.swept)); }},
    IndexField{"split", "sc:Text", false, "train, val or test.",
               [](const SequenceFacts& s) { return Json(split_name(s.split)); }},
    IndexField{"group", "sc:Integer", false,
               "Sequences of one group show ground that hangs together, and are in one split.",
               [](const SequenceFacts& s) { return Json(s.group); }},
    IndexField{"world", "sc:Text", false, "The world that it flies in.",
               [](const SequenceFacts& s) { return Json(printable(s.world)); }},
    IndexField{"formats", "sc:Text", true, "The formats that it is exported in.",
               [](const SequenceFacts& s) { return Json::array_of(sorted_formats(s)); }},
    IndexField{"folders", "sc:Text", true, "Where each of these formats' datasets lies.",
               [](const SequenceFacts& s) {
                 std::vector<std::string> folders = sorted_formats(s);
                 for (std::string& folder : folders) folder += "/" + printable(s.run);
                 return Json::array_of(folders);
               }},
    IndexField{"frames", "sc:Integer", false, "Instants at which all cameras took an image.",
               [](const SequenceFacts& s) { return Json(s.num_frames); }},
    IndexField{"cameras", "sc:Integer", false, "Cameras of all rigs.",
               [](const SequenceFacts& s) { return Json(s.num_cameras); }},
    IndexField{"utc_start", "sc:Text", false, "Time of the first frame, UTC.",
               [](const SequenceFacts& s) { return Json(printable(s.utc_start)); }},
    IndexField{"duration_s", "sc:Float", false, "From the first frame to the last, s.",
               [](const SequenceFacts& s) { return Json(s.duration_s); }},
    IndexField{"track_length_m", "sc:Float", false, "Of the lines between the body's places, m.",
               [](const SequenceFacts& s) { return Json(s.track_length_m); }},
    IndexField{"lat_deg", "sc:Float", false, "Latitude of the first frame, WGS84.",
               [](const SequenceFacts& s) { return Json(s.lat_deg); }},
    IndexField{"lon_deg", "sc:Float", false, "Longitude of the first frame, WGS84.",
               [](const SequenceFacts& s) { return Json(s.lon_deg); }},
    IndexField{"south_deg", "sc:Float", false, "Least latitude of the track.",
               [](const SequenceFacts& s) { return Json(s.south_deg); }},
    IndexField{"north_deg", "sc:Float", false, "Greatest latitude of the track.",
               [](const SequenceFacts& s) { return Json(s.north_deg); }},
    IndexField{"west_deg", "sc:Float", false,
               "Westmost longitude of the track; above east_deg across the 180 degree meridian.",
               [](const SequenceFacts& s) { return Json(s.west_deg); }},
    IndexField{"east_deg", "sc:Float", false, "Eastmost longitude of the track.",
               [](const SequenceFacts& s) { return Json(s.east_deg); }},
    IndexField{"lowest_m", "sc:Float", false, "Least height of the track above the ellipsoid, m.",
               [](const SequenceFacts& s) { return Json(s.lowest_m); }},
    IndexField{"highest_m", "sc:Float", false,
               "Greatest height of the track above the ellipsoid, m.",
               [](const SequenceFacts& s) { return Json(s.highest_m); }},
    IndexField{"ground_cells", "sc:Integer", false,
               "Cells of ground, of about 100 m by 100 m, that its images show.",
               [](const SequenceFacts& s) { return Json(s.num_ground_cells); }},
};

std::vector<const SequenceFacts*> by_id(const std::vector<SequenceFacts>& sequences) {
  std::vector<const SequenceFacts*> sorted;
  for (const SequenceFacts& sequence : sequences) sorted.push_back(&sequence);
  std::sort(sorted.begin(), sorted.end(),
            [](const SequenceFacts* a, const SequenceFacts* b) { return a->id() < b->id(); });
  return sorted;
}

}  // namespace

std::span<const IndexField> index_fields() { return kFields; }

std::string index_lines(const std::vector<SequenceFacts>& sequences) {
  std::string text;
  for (const SequenceFacts* sequence : by_id(sequences)) {
    Json line = Json::object();
    for (const IndexField& field : kFields) line.set(field.name, field.value(*sequence));
    text += line.text(-1) + "\n";
  }
  return text;
}

std::string split_lines(const std::vector<SequenceFacts>& sequences, Split split) {
  std::string text;
  for (const SequenceFacts* sequence : by_id(sequences))
    if (sequence->split == split) text += printable(sequence->id()) + "\n";
  return text;
}

}  // namespace terracast::batch
