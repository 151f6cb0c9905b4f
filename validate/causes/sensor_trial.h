#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "validate/body_pose.h"
#include "validate/check.h"
#include "validate/readers/sensors.h"

/// Supposed mistakes in the samples of one sensor beside cameras.
namespace terracast::validate {

/// How much of its bound each result of one sensor takes: over 1 where it fails.
using SensorShares = std::map<std::string, double>;

/// What is known before hypotheses are made.
struct SensorSymptoms {
  const Dataset& dataset;
  const Sequence& sequence;
  const SensorRecord& sensor;
  const std::vector<SensorRecord>& all;  ///< the sequence's sensors
  const SensorShares& shares;
  Undulation undulation_m;

  bool fails(std::string_view start) const;  ///< any result whose name begins so
};

/// A supposed cause.
struct SensorHypothesis {
  /// Less is simpler; decides between causes that repair equally much.
  int rank = 1;
  /// Undoes the cause, and says it after "RIG/NAME: ".
  /// returns  false where it does not apply
  std::function<bool(SensorRecord&, Cause&)> undo;
};

/// One file of causes: adds its hypotheses.
using SensorCauseMaker = void (*)(const SensorSymptoms&, std::vector<SensorHypothesis>&);

/// A hypothesis whose words are known beforehand.
SensorHypothesis simple_cause(const char* name, std::string words, int rank,
                              std::function<bool(SensorRecord&)> undo);

/// Samples that are late by whole samples, or early: some of the columns [first, end) of all rows hold the row before's.
/// What is not there is taken from the polynomial through the samples beside it.
void add_late(const SensorSymptoms& symptoms, std::size_t first, std::size_t end, const char* what,
              std::vector<SensorHypothesis>& hypotheses);

/// Right and wrong values of a vector along a sensor's axes.
struct VectorPair {
  Eigen::Vector3d right, wrong;
};
/// The matrix of -1, 0 and 1, one of each row and column, that takes right vectors next to the wrong ones; nothing where
/// it is the identity, or another one does nearly as well.
std::optional<Eigen::Matrix3d> exchange_of_axes(const std::vector<VectorPair>& pairs);
/// "x, y, z are y, -x, z": which right axes stand in the places of the three.
std::string words_of_axes(const Eigen::Matrix3d& wrong_from_right);

/// A sample's frame, where it is at one's time and the body has a pose there.
struct SampleAtFrame {
  std::size_t sample = 0;
  Pose ecef_from_body;
};
std::vector<SampleAtFrame> samples_at_frames(const Sequence& sequence, const SensorRecord& sensor);

}  // namespace terracast::validate
