#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/json.h"
#include "validate/findings.h"
#include "validate/geometry.h"
#include "validate/shutter.h"

/// What a dataset says of things that move: `moving` of dataset.json, moving.csv, and masks that say which pixels
/// show them.
namespace terracast::validate {

struct Dataset;

/// A body at a frame's time.
struct MovingState {
  Pose local_from_body;
  BodyMotion motion;  ///< along the body's axes

  Pose local_from_body_at(double offset_s) const {
    return local_from_body * motion.start_from_body(offset_s);
  }
};

/// What dataset.json says of a body.
struct MovingBody {
  std::string thing;       ///< of which model it is
  std::string class_name;  ///< empty: not stated, as of what follows
  std::int64_t instance_id = -1;
  std::string part_of;  ///< name of the body that it is a part of; empty: of none
  /// Along the body's axes; empty: not stated.
  Eigen::AlignedBox3d box_m;
};

struct Moving {
  std::vector<std::string> names;  ///< of body 1, 2, …
  std::string masks;               ///< folder of the masks, by camera
  /// By frame, then body; nothing: it is not there.
  std::vector<std::vector<std::optional<MovingState>>> states;
  std::vector<MovingBody> bodies = {};  ///< as names

  /// body   from 1
  /// returns  null where it is not there
  const MovingState* state(int frame, int body) const;
};

/// Reads dataset.json's `moving` and moving.csv.
/// throws  Input: a member that is not as it must be; of the file findings tell
Moving read_moving(const Dataset& dataset, const core::Json& json, int num_frames,
                   Findings& findings);

}  // namespace terracast::validate
