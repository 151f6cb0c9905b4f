#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "capture/frame_writer.h"
#include "capture/sink.h"
#include "core/log.h"
#include "core/progress.h"
#include "core/scratch_pool.h"
#include "render/input_hash.h"
#include "render/reuse.h"
#include "render/visited_tiles.h"
#include "sensors/camera/frame_renderer.h"

namespace terracast::render {

/// What is done with the frames of one sequence: they are rendered into a sink, or taken from earlier captures.
class SequenceWork {
 public:
  /// All must outlive the work.
  SequenceWork(const SequencePlan& plan, const world::TileStore& store,
               const world::RayQuery& query, const sensors::FrameRenderer& renderer,
               const std::vector<capture::TrackPoint>& tracks);

  /// Takes over those of some frames whose images stand in one of the earlier folders.
  /// returns   which, ascending
  std::vector<int> take_over(const std::vector<int>& frames,
                             const std::vector<std::filesystem::path>& earlier_folders,
                             const capture::SequenceWriter& writer, const core::Log& log,
                             core::Progress& progress) const;

  /// The images of all cameras and the samples of all sensors, frame by frame in the order that is given.
  void render(const std::vector<int>& frames, const capture::Sink& sink,
              core::Progress& progress) const;

 private:
  std::vector<EarlierFrames> open_earlier(const std::vector<std::filesystem::path>& folders,
                                          const capture::SequenceWriter& writer,
                                          const core::Log& log) const;
  /// returns   whether one of the earlier captures has the frame
  bool take_over_frame(int frame, const std::vector<EarlierFrames>& all_earlier,
                       const capture::SequenceWriter& writer) const;
  /// trail   takes the tiles to which the images' rays come
  capture::CameraRecord render_camera(int frame, int camera, const capture::Sink& sink,
                                      world::RayTrail& trail) const;
  /// Measures with all sensors beside cameras from the frame's time to before the next one's.
  /// memories   one a sensor
  std::vector<capture::FrameFile> measure(
      int frame, const capture::Sink& sink, world::RayTrail& trail,
      std::vector<std::unique_ptr<sensors::ScanMemory>>& memories) const;
  std::vector<std::int64_t> find_visible_tracks(int frame, int camera) const;
  capture::LabelBounds bounds(int frame, int camera, const sensors::TruthFrame& truth) const;
  capture::FrameRecord start_record(int frame) const;
  void expect_frames(const std::vector<int>& frames, std::size_t first) const;

  const SequencePlan& plan_;
  const world::TileStore& store_;
  const world::RayQuery& query_;
  const sensors::FrameRenderer& renderer_;
  const std::vector<capture::TrackPoint>& tracks_;
  std::vector<Eigen::Vector3d> track_points_world_;
  std::vector<capture::MovingBody> bodies_;
  std::vector<capture::TileScale> tiles_;  ///< of the cut
  FrameKeys keys_;
  FrameSight sight_;
  mutable core::ScratchPool<sensors::TruthFrame> truth_frames_;
};

}  // namespace terracast::render
