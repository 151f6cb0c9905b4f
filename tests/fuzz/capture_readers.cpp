// The JSON files of captured sequences, behind the hashes that they carry.

#include <string>
#include <vector>

#include "capture/frame_record_json.h"
#include "capture/manifest.h"
#include "capture/sequence_json.h"
#include "capture/tracks_json.h"
#include "core/json.h"
#include "core/registry.h"
#include "sensors/sensor.h"
#include "tests/fuzz/scratch.h"
#include "tests/support/tiny_capture.h"

namespace terracast::fuzz {
namespace {

/// With a content_hash that is right.
core::Json sealed_json(Bytes input) {
  core::Json json = core::Json::parse(text_of(input), "fuzz.json");
  if (json.is_object()) core::add_content_hash(json);
  return json;
}

const capture::SequenceInfo& sequence() {
  static const capture::SequenceInfo info =
      test::tiny_sequence({.num_frames = 2, .has_tartan2 = false});
  return info;
}

}  // namespace

void fuzz_capture_sequence(Bytes input) {
  const capture::SequenceInfo info = capture::sequence_from_json(sealed_json(input), "fuzz.json");
  capture::json_from_sequence(info);
}

void fuzz_capture_frame(Bytes input) {
  const capture::FrameRecord record =
      capture::record_from_json(sealed_json(input), sequence(), "fuzz.json");
  capture::json_from_record(record, sequence().input_hash);
}

void fuzz_capture_tracks(Bytes input) {
  capture::json_from_tracks(capture::tracks_from_json(sealed_json(input), "fuzz.json"));
}

void fuzz_capture_manifest(Bytes input) {
  capture::manifest_from_json(sealed_json(input), sequence(), "fuzz.json");
}

/// Scans of a lidar's own columns.
void fuzz_capture_scans(Bytes input) {
  static const std::vector<capture::StreamChannel> channels =
      core::find_registered(sensors::sensors(), "sensor", "lidar").make()->channels();
  const capture::Samples scans =
      capture::decode_scans(input, {.first = 0, .end = 1}, 10.0, channels, "fuzz.npy");
  capture::encode_scans(scans, channels);
}

}  // namespace terracast::fuzz
