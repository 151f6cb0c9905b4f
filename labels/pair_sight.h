#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "labels/label.h"
#include "labels/matches.h"

namespace terracast::labels {

/// Where what images of one sequence show is in those of another, or in others of its own. Things that move are the
/// same ones by their names; a body is not seen by its own cameras, and so is not in their images, hidden by nothing
/// and hiding nothing there.
class PairSight {
 public:
  /// inputs   of the sequence whose images show the points; they must outlive this
  /// to       the other; null: the same sequence
  /// throws   Config: the two show different geometries; Input: the store is not the world of both
  PairSight(const LabelInputs& inputs, const capture::SequenceReader* to);

  /// Of all that labels follow from: capture::labels_source() of both, with a blank between, or of the one.
  const std::string& source() const { return source_; }

  /// As Matcher::points(), of the first sequence.
  std::vector<std::optional<ShownPoint>> points(const ImageOf& from,
                                                const capture::CameraFrame& facts,
                                                std::span<const Eigen::Vector2i> pixels) const {
    return matcher_.points(from, facts, pixels);
  }
  /// As Matcher::follow(), to an image of the other sequence, whose instance ids occluders have.
  std::vector<std::optional<Sighting>> follow(std::span<const ShownPoint> points,
                                              const ImageOf& to) const;
  /// As Matcher::is_there(), at a frame of the other sequence. The body of that sequence is not there for its cameras.
  bool is_there(const ShownPoint& point, int to_frame) const;
  /// Motion of the image points of pixels that show the sky, by rotation alone (capture::flow).
  std::vector<std::optional<Eigen::Vector2d>> sky_flow(const ImageOf& from,
                                                       std::span<const Eigen::Vector2i> pixels,
                                                       const ImageOf& to) const;
  /// As Matcher::motion(), to a frame of the other sequence. The body of that sequence is where the first one has it
  /// at its frame of that number, if it has one.
  std::optional<Eigen::Vector3d> motion(const ShownPoint& point, int to_frame) const;

 private:
  /// Of a second sequence.
  struct Other {
    scene::MovingBodies moving;
    Matcher matcher;
    std::vector<std::optional<std::size_t>> bodies;  ///< of it, by those of the first sequence
    Other(const LabelInputs& inputs, const capture::SequenceReader& to);
  };

  /// The same point by the other sequence's bodies; nothing: it is of one that is not among them.
  std::optional<ShownPoint> as_other_has_it(const ShownPoint& point) const;

  const capture::SequenceReader& from_;
  const capture::SequenceReader& to_;
  Matcher matcher_;
  std::unique_ptr<const Other> other_;  ///< null: the same sequence
  std::string source_;
};

}  // namespace terracast::labels
