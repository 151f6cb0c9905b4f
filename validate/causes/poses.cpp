#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "validate/causes/trial.h"
#include "validate/sampling.h"

/// Poses as the format's file holds them: inverted, transposed, in another order, unit or frame, of
/// another row. Truth is georeference.csv, and the images.
namespace terracast::validate {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Rows = std::vector<std::optional<Pose>>;

/// From a camera's pose to what its format writes: A pose B, or the inverse of that.
struct Writing {
  Pose left, right;
  bool is_inverse = false;

  Pose written(const Pose& local_from_camera) const {
    const Pose pose = left * local_from_camera * right;
    return is_inverse ? pose.inverse() : pose;
  }
  Pose read(const Pose& written) const {
    return left.inverse() * (is_inverse ? written.inverse() : written) * right.inverse();
  }
};

Matrix3d rows(const Vector3d& x, const Vector3d& y, const Vector3d& z) {
  Matrix3d m;
  m << x.transpose(), y.transpose(), z.transpose();
  return m;
}
const Vector3d kX = Vector3d::UnitX(), kY = Vector3d::UnitY(), kZ = Vector3d::UnitZ();
const Matrix3d kRdfFromFlu = rows(-kY, -kZ, kX);
const Matrix3d kFluFromRdf = kRdfFromFlu.transpose();
const Matrix3d kRdfFromFrd = rows(kY, kZ, kX);

Writing writing_of(const Trial& trial, int camera) {
  const std::string& format = trial.dataset->format;
  Writing writing;
  if (format.starts_with("tartanair")) {
    writing.left.rotation = rows(kY, kX, -kZ);  // north, east, down from east, north, up
    writing.right.rotation = kRdfFromFrd;       // right, down, forward from forward, right, down
  } else if (format == "kitti") {
    writing.left = trial.local_from_first.inverse();
    writing.right = trial.camera(camera).camera0_from_camera.inverse();
  } else if (format == "colmap") {
    writing.is_inverse = true;
  }
  return writing;
}

const char* file_of(const Trial& trial) {
  const std::string& format = trial.dataset->format;
  return format == "kitti" ? "poses" : format == "colmap" ? "poses of images.bin" : "poses";
}

/// A change of written rows.
using Change = std::function<Pose(const Pose&)>;

void change_rows(Trial& trial, int camera, const Change& change) {
  const Writing writing = writing_of(trial, camera);
  for (auto& pose : trial.camera(camera).local_from_camera)
    if (pose) pose = writing.read(change(writing.written(*pose)));
}

struct Unit {
  double factor;
  const char* words;
  const char* unit;
};
constexpr Unit kUnits[] = {{1e-3, "are in millimetres where metres are meant", "mm"},
                           {1e-2, "are in centimetres where metres are meant", "cm"},
                           {1e3, "are in kilometres where metres are meant", "km"},
                           {0.3048, "are in feet where metres are meant", "ft"}};

/// What poses are held against beside georeference.csv.
const std::vector<std::string_view> kJudges = {"georeference",        "reprojection",
                                               "georeference_origin", "calibration",
                                               "trajectory",          "colmap_observations"};

/// The same change of all cameras' rows, or of one camera's.
/// words  with a place for "poses", or "poses of <camera>"
void add_change(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses, const char* name,
                std::string words, int rank, const Change& change, double size = 0.0,
                const char* unit = "") {
  const int num_cameras = symptoms.trial.num_cameras();
  for (int only = -1; only < (num_cameras > 1 ? num_cameras : 0); ++only) {
    Hypothesis h;
    h.checks = kJudges;
    h.rank = rank + (only < 0 ? 0 : 1);
    h.undo = [=](Trial& trial, Cause& cause) {
      for (int c = 0; c < trial.num_cameras(); ++c)
        if (only < 0 || only == c) change_rows(trial, c, change);
      cause.name = name;
      cause.camera = only < 0 ? "" : trial.camera(only).name;
      cause.size = size;
      cause.unit = unit;
      cause.words = only < 0 ? fmt::format("{} {}", file_of(trial), words)
                             : fmt::format("{} of {} {}", file_of(trial), cause.camera, words);
      return true;
    };
    hypotheses.push_back(std::move(h));
    if (symptoms.trial.dataset->format == "kitti") break;  // one file for all
  }
}

/// The rows of a camera as georeference.csv has them.
Rows true_rows(const Trial& trial, int camera) {
  const Writing writing = writing_of(trial, camera);
  const Pose local_from_ecef = ecef_from_local(trial.sequence.origin).inverse();
  Rows result;
  for (const auto& row : trial.camera(camera).georeference) {
    result.emplace_back();
    if (row)
      result.back() = writing.written(
          local_from_ecef * Pose{enu_from_ecef(row->place).transpose() * row->enu_from_camera,
                                 ecef_from_geodetic(row->place)});
  }
  return result;
}

/// All 48 changes of axes and signs, the identity first.
std::vector<Matrix3d> signed_permutations() {
  std::vector<Matrix3d> all;
  std::array<int, 3> order{0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Matrix3d m = Matrix3d::Zero();
      for (int i = 0; i < 3; ++i)
        m(i, order[static_cast<std::size_t>(i)]) = signs >> i & 1 ? -1 : 1;
      all.push_back(m);
    }
  } while (std::next_permutation(order.begin(), order.end()));
  return all;
}

/// "(y, -x, z)": where the true axes stand among those of the file.
std::string axes_words(const Matrix3d& true_from_file) {
  std::string text;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      if (true_from_file(i, j) != 0.0)
        text += fmt::format("{}{}{}", i == 0 ? "(" : ", ", true_from_file(i, j) < 0.0 ? "-" : "",
                            "xyz"[j]);
  return text + ")";
}

/// Axes of the world and of the camera that lead from the file's rows to georeference.csv's.
struct Axes {
  Matrix3d left, right, position;
};
std::optional<Axes> find_axes(const Rows& found, const Rows& truth) {
  constexpr double kNear = 0.02;  // a degree: what is left is another cause's
  std::vector<std::pair<const Pose*, const Pose*>> both;
  double largest_m = 0.0;
  for (std::size_t i = 0; i < found.size() && i < truth.size(); ++i)
    if (found[i] && truth[i]) {
      both.emplace_back(&*found[i], &*truth[i]);
      largest_m = std::max(largest_m, truth[i]->translation.norm());
    }
  if (both.size() < 2 || largest_m < 1.0) return std::nullopt;
  const std::vector<Matrix3d> all = signed_permutations();
  const auto changes = [](const Matrix3d& m) { return 3.0 - m.diagonal().cwiseMax(0.0).sum(); };
  std::optional<Axes> best;
  double least = 1e9;
  for (const Matrix3d& left : all)
    for (const Matrix3d& right : all) {
      if (left.determinant() < 0.0 || right.determinant() < 0.0) continue;
      if (changes(left) + changes(right) >= least) continue;
      const bool fits = std::all_of(both.begin(), both.end(), [&](const auto& pair) {
        return (left * pair.first->rotation * right - pair.second->rotation).norm() < kNear;
      });
      if (!fits) continue;
      least = changes(left) + changes(right);
      best = Axes{left, right, Matrix3d::Zero()};
    }
  if (!best) return std::nullopt;
  double nearest = kNear * largest_m;
  for (const Matrix3d& position : all) {
    double off = 0.0;
    for (const auto& [from, to] : both)
      off = std::max(off, (position * from->translation - to->translation).norm());
    // A change that is no change is taken where it does as well.
    if (off >= nearest * (position.isIdentity() ? 1.0 + 1e-9 : 0.999)) continue;
    nearest = off;
    best->position = position;
  }
  if (best->position.isZero()) return std::nullopt;
  if (best->left.isIdentity() && best->right.isIdentity() && best->position.isIdentity())
    return std::nullopt;
  return best;
}

std::string words_of(const Axes& axes, const Trial& trial) {
  const Matrix3d swap = rows(kY, kX, -kZ);
  const bool is_colmap = trial.dataset->format == "colmap";
  // COLMAP writes the camera from the world: the world's axes stand to the right.
  const Matrix3d& world = is_colmap ? axes.right : axes.left;
  const Matrix3d camera = is_colmap ? axes.left : axes.right;
  const bool is_camera_same =
      camera.isIdentity() && (is_colmap ? axes.position.isIdentity() : axes.position == world);
  if (is_camera_same && world == swap)
    return trial.dataset->format.starts_with("tartanair")
               ? "stand in east, north, up where north, east, down is meant"
               : "stand in north, east, down where east, north, up is meant";
  if (world.isIdentity() && camera.isIdentity()) {
    std::string flipped;
    for (int i = 0; i < 3; ++i)
      if (axes.position(i, i) == -1.0)
        flipped += (flipped.empty() ? "" : " and ") + std::string(1, "xyz"[i]);
    if (flipped.empty())
      return fmt::format("have positions in other axes: {} is meant", axes_words(axes.position));
    return flipped.size() == 1
               ? fmt::format("have a flipped axis: {} of the positions has the opposite sign",
                             flipped)
               : fmt::format("have flipped axes: {} of the positions have the opposite sign",
                             flipped);
  }
  // KITTI's rows stand between two cameras: other axes of the camera change both sides.
  const bool is_relative = trial.dataset->format.starts_with("kitti");
  const bool is_camera_alone =
      is_relative ? world == camera.transpose() && axes.position == world : world.isIdentity();
  if (is_camera_alone && camera == (is_relative ? kFluFromRdf : kRdfFromFlu))
    return "stand in forward, left, up where right, down, forward is meant";
  if (is_camera_alone && camera == kRdfFromFrd)
    return "stand in right, down, forward where forward, right, down is meant";
  const Matrix3d opengl = Vector3d(1, -1, -1).asDiagonal();
  if (is_camera_alone && camera == opengl)
    return fmt::format("have flipped axes: y and z of the camera have the opposite sign ({})",
                       trial.dataset->format.starts_with("tartanair")
                           ? "left and up"
                           : "up and back, as in OpenGL");
  return fmt::format(
      "stand in other axes: what is meant is {} of the file's world and {} of its camera",
      axes_words(world), axes_words(camera.transpose()));
}

void add_axes(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  const int num_cameras = symptoms.trial.num_cameras();
  for (int only = -1; only < (num_cameras > 1 ? num_cameras : 0); ++only) {
    Hypothesis h;
    h.checks = kJudges;
    h.rank = 4 + (only < 0 ? 0 : 1);
    h.undo = [only](Trial& trial, Cause& cause) {
      const int sample = std::max(only, 0);
      const Writing writing = writing_of(trial, sample);
      Rows found;
      for (const auto& pose : trial.camera(sample).local_from_camera) {
        found.emplace_back();
        if (pose) found.back() = writing.written(*pose);
      }
      const auto axes = find_axes(found, true_rows(trial, sample));
      if (!axes) return false;
      for (int c = 0; c < trial.num_cameras(); ++c)
        if (only < 0 || only == c)
          change_rows(trial, c, [&](const Pose& row) {
            return Pose{axes->left * row.rotation * axes->right, axes->position * row.translation};
          });
      cause.name = "pose_axes";
      cause.camera = only < 0 ? "" : trial.camera(only).name;
      cause.words = fmt::format("{}{}{} {}", file_of(trial), only < 0 ? "" : " of ", cause.camera,
                                words_of(*axes, trial));
      return true;
    };
    hypotheses.push_back(std::move(h));
  }
}

/// Rows of the frame so much later or earlier; at the ends there are none.
void add_shifts(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  // With georeference.csv moved along the images alone can tell.
  for (const bool is_alone : {true, false})
    for (const int shift : {1, -1, 2, -2}) {
      if (is_alone != symptoms.fails("georeference")) continue;
      // Poses of another frame would begin elsewhere.
      if (is_alone && symptoms.trial.begins_at_origin) continue;
      // Images judge by two frames at least, and by what they share.
      if (!is_alone && symptoms.fails("depth_unit")) continue;
      if (!is_alone && symptoms.trial.num_frames() < std::abs(shift) + 2) continue;
      Hypothesis h;
      h.checks = kJudges;
      if (!is_alone) h.checks = {"reprojection", "photometric", "calibration", "trajectory"};
      // A shift leaves frames at an end without pose: one bad image there is simpler.
      h.rank = 2 + (is_alone ? 0 : 8) + std::abs(shift);
      h.undo = [=](Trial& trial, Cause& cause) {
        for (int c = 0; c < trial.num_cameras(); ++c) {
          Camera& camera = trial.camera(c);
          const auto move = [&](auto& list) {
            const auto old = list;
            for (std::size_t i = 0; i < list.size(); ++i) {
              const auto from = static_cast<std::ptrdiff_t>(i) - shift;
              if (from >= 0 && from < static_cast<std::ptrdiff_t>(old.size()))
                list[i] = old[static_cast<std::size_t>(from)];
              else
                list[i].reset();
            }
          };
          move(camera.local_from_camera);
          if (!is_alone)
            for (auto& row : camera.georeference) row.reset();
        }
        // What was made with the poses goes with them.
        if (!is_alone) {
          trial.sequence.oxts.clear();
          trial.model.reset();
        }
        cause.name = "pose_shifted";
        cause.size = shift;
        cause.unit = "frames";
        const bool has_packets = trial.dataset->format == "kitti_raw";
        cause.words = fmt::format("{}{} are shifted by {} frame{}: each is that of the frame {}",
                                  has_packets ? "OXTS packets, poses" : file_of(trial),
                                  is_alone ? "" : " and georeference.csv", std::abs(shift),
                                  std::abs(shift) > 1 ? "s" : "", shift > 0 ? "after" : "before");
        return true;
      };
      hypotheses.push_back(std::move(h));
    }
}

bool is_same(const Pose& a, const Pose& b) {
  constexpr double kTolerance_m = 2e-3, kTolerance = 2e-5;
  return (a.translation - b.translation).norm() < kTolerance_m &&
         (a.rotation - b.rotation).norm() < kTolerance;
}

/// How far a row is off.
std::string off_words(const Pose& found, const Pose& right) {
  const double turn_rad = rotation_angle_rad(found.rotation.transpose() * right.rotation);
  return fmt::format("it is off by {:.4g} m and {:.4g} deg",
                     (found.translation - right.translation).norm(),
                     turn_rad < 1e-6 ? 0.0 : degrees_from_radians(turn_rad));
}

/// Single rows: found where georeference.csv and the file's rows differ, and nowhere else.
void add_rows(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  if (!symptoms.fails("georeference") && !symptoms.fails("trajectory")) return;
  Hypothesis h;
  h.checks = kJudges;
  h.rank = 7;
  h.undo = [](Trial& trial, Cause& cause) {
    std::vector<int> wrong;
    std::string what;
    const Rows originals = trial.camera(0).local_from_camera;
    for (int c = 0; c < trial.num_cameras(); ++c) {
      const Rows truth = true_rows(trial, c);
      const Writing writing = writing_of(trial, c);
      auto& poses = trial.camera(c).local_from_camera;
      const auto found = poses;
      for (std::size_t i = 0; i < poses.size(); ++i) {
        if (!found[i] || !truth[i]) continue;
        const Pose right = writing.read(*truth[i]);
        if (is_same(*found[i], right)) continue;
        if (std::find(wrong.begin(), wrong.end(), static_cast<int>(i)) == wrong.end())
          wrong.push_back(static_cast<int>(i));
        for (std::size_t j = 0; j < truth.size() && what.empty(); ++j)
          if (truth[j] && j != i && is_same(*found[i], writing.read(*truth[j])))
            what = fmt::format("it is that of frame {}", trial.first_frame + static_cast<int>(j));
        if (what.empty()) what = off_words(*found[i], right);
        poses[i] = right;
      }
    }
    // Cameras that georeference.csv does not speak of (KITTI's grey ones) go with the first.
    const Rows first = true_rows(trial, 0);
    for (const int frame : wrong) {
      const auto f = static_cast<std::size_t>(frame);
      for (int c = 1; c < trial.num_cameras(); ++c) {
        auto& pose = trial.camera(c).local_from_camera[f];
        if (!pose || trial.camera(c).georeference[f] || !first[f] || !originals[f]) continue;
        pose = writing_of(trial, 0).read(*first[f]) * originals[f]->inverse() * *pose;
      }
    }
    // More than a third of all rows is no single mistake.
    if (wrong.empty() || 3 * static_cast<int>(wrong.size()) > trial.num_frames()) return false;
    cause.name = "pose_row";
    cause.frame = trial.first_frame + wrong[0];
    cause.words = fmt::format("the pose of frame {} is wrong: {}", cause.frame, what);
    if (wrong.size() > 1)
      cause.words += fmt::format("; so is that of frame {}", trial.first_frame + wrong[1]);
    return true;
  };
  hypotheses.push_back(std::move(h));
}

void add_float32(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  Hypothesis h;
  h.checks = kJudges;
  h.rank = 1;
  h.undo = [](Trial& trial, Cause& cause) {
    double largest_m = 0.0, worst_m = 0.0;
    for (int c = 0; c < trial.num_cameras(); ++c) {
      const Rows truth = true_rows(trial, c);
      const Writing writing = writing_of(trial, c);
      auto& poses = trial.camera(c).local_from_camera;
      for (std::size_t i = 0; i < poses.size(); ++i) {
        if (!poses[i] || !truth[i]) continue;
        // COLMAP's translations are products: of them only the size of the error tells.
        const bool is_product = trial.dataset->format == "colmap";
        const Vector3d found =
            is_product ? poses[i]->translation : writing.written(*poses[i]).translation;
        const Vector3d right =
            is_product ? writing.read(*truth[i]).translation : truth[i]->translation;
        for (int k = 0; k < 3; ++k) {
          const auto rounded = static_cast<double>(static_cast<float>(found[k]));
          const double step = 0x1p-23 * (is_product ? right.norm() : std::abs(right[k]));
          if (!is_product && std::abs(rounded - found[k]) > 1e-6) return false;
          if (std::abs(found[k] - right[k]) > step + 1e-6) return false;
          largest_m = std::max(largest_m, std::abs(right[k]));
          worst_m = std::max(worst_m, std::abs(found[k] - right[k]));
        }
        poses[i]->translation = writing.read(*truth[i]).translation;
      }
    }
    if (largest_m < 4096.0) return false;
    cause.name = "pose_float32";
    cause.size = worst_m;
    cause.unit = "m";
    cause.words = fmt::format(
        "{} are rounded to 32-bit floats {:.1f} km from their origin: off by up to {:.4f} m",
        file_of(trial), 1e-3 * largest_m, worst_m);
    return true;
  };
  if (symptoms.fails("georeference")) hypotheses.push_back(std::move(h));
}

/// Camera 0 of each frame in camera 0 of the trial's first, by packets.
Rows rows_of_packets(const Trial& trial) {
  const auto& packets = trial.sequence.oxts;
  const Pose imu_from_camera = trial.sequence.camera0_from_imu.inverse();
  Rows result(packets.size());
  if (packets.empty() || !packets[0]) return result;
  const Pose first_from_ecef = (packets[0]->ecef_from_imu() * imu_from_camera).inverse();
  for (std::size_t i = 0; i < packets.size(); ++i)
    if (packets[i]) result[i] = first_from_ecef * packets[i]->ecef_from_imu() * imu_from_camera;
  return result;
}

/// KITTI raw: the poses beside the packets, against the packets.
void add_stated_poses(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  if (symptoms.trial.sequence.first_from_camera0.empty() || !symptoms.fails("oxts")) return;
  const auto add = [&](int rank, std::function<bool(Trial&, std::vector<Pose>&, Cause&)> change) {
    Hypothesis h;
    h.checks = {"oxts"};
    h.rank = rank;
    h.undo = [=](Trial& trial, Cause& cause) {
      if (!change(trial, trial.sequence.first_from_camera0, cause)) return false;
      cause.words = "poses.txt: " + cause.words;
      return true;
    };
    hypotheses.push_back(std::move(h));
  };
  const auto add_change = [&](const char* name, const char* words, const Change& change,
                              double size = 0.0, const char* unit = "") {
    add(1, [=](Trial&, std::vector<Pose>& stated, Cause& cause) {
      for (Pose& pose : stated) pose = change(pose);
      cause.name = name;
      cause.size = size;
      cause.unit = unit;
      cause.words = fmt::format("poses {}", words);
      return true;
    });
  };
  add_change("pose_inverted", "are inverted (first frame in each where each in the first is meant)",
             [](const Pose& p) { return p.inverse(); });
  add_change("pose_transposed", "have transposed rotations", [](const Pose& p) {
    return Pose{p.rotation.transpose(), p.translation};
  });
  for (const Unit& unit : kUnits)
    add_change(
        "pose_unit", unit.words,
        [factor = unit.factor](const Pose& p) {
          return Pose{p.rotation, factor * p.translation};
        },
        1.0 / unit.factor, unit.unit);
  add(2, [](Trial& trial, std::vector<Pose>& stated, Cause& cause) {
    const auto axes = find_axes({stated.begin(), stated.end()}, rows_of_packets(trial));
    if (!axes) return false;
    for (Pose& pose : stated)
      pose = {axes->left * pose.rotation * axes->right, axes->position * pose.translation};
    cause.name = "pose_axes";
    cause.words = "poses " + words_of(*axes, trial);
    return true;
  });
  for (const int shift : {1, -1, 2, -2})
    add(2 + std::abs(shift), [shift](Trial& trial, std::vector<Pose>& stated, Cause& cause) {
      const Rows right = rows_of_packets(trial);
      std::size_t num_same = 0;
      for (std::size_t i = 0; i < stated.size() && i < right.size(); ++i) {
        const auto from = static_cast<std::ptrdiff_t>(i) + shift;
        if (!right[i]) return false;
        if (from < 0 || from >= static_cast<std::ptrdiff_t>(right.size())) continue;
        const auto& other = right[static_cast<std::size_t>(from)];
        if (!other || !is_same(*other, stated[i])) return false;
        ++num_same;
      }
      if (num_same < 2 || right.size() < stated.size()) return false;
      for (std::size_t i = 0; i < stated.size(); ++i) stated[i] = *right[i];
      cause.name = "pose_shifted";
      cause.size = shift;
      cause.unit = "frames";
      cause.words = fmt::format("poses are shifted by {} frame{}: each is that of the frame {}",
                                std::abs(shift), std::abs(shift) > 1 ? "s" : "",
                                shift > 0 ? "after" : "before");
      return true;
    });
  add(7, [](Trial& trial, std::vector<Pose>& stated, Cause& cause) {
    const Rows right = rows_of_packets(trial);
    const std::vector<Pose> found = stated;
    std::size_t num_wrong = 0;
    for (std::size_t i = 0; i < stated.size() && i < right.size(); ++i) {
      if (!right[i]) return false;
      if (is_same(*right[i], stated[i])) continue;
      stated[i] = *right[i];
      if (++num_wrong > 1) continue;
      cause.frame = trial.first_frame + static_cast<int>(i);
      std::string what = off_words(found[i], *right[i]);
      for (std::size_t j = 0; j < found.size(); ++j)
        if (j != i && is_same(found[j], found[i]))
          what = fmt::format("it is that of frame {}", trial.first_frame + static_cast<int>(j));
      cause.words = fmt::format("the pose of frame {} is wrong: {}", cause.frame, what);
    }
    cause.name = "pose_row";
    // More than a third of all rows is no single mistake.
    return num_wrong > 0 && 3 * num_wrong <= stated.size();
  });
}

}  // namespace

void make_poses_causes(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  if (symptoms.trial.dataset->format == "kitti_raw") {
    add_stated_poses(symptoms, hypotheses);
    const bool do_images_differ = symptoms.fails("reprojection") || symptoms.fails("photometric");
    if (do_images_differ && !symptoms.fails("georeference")) add_shifts(symptoms, hypotheses);
    return;
  }
  if (!symptoms.fails("georeference") && !symptoms.fails("reprojection") &&
      !symptoms.fails("photometric") && !symptoms.fails("trajectory"))
    return;
  // Poses that agree with georeference.csv can only be wrong together with it.
  if (!symptoms.fails("georeference") && !symptoms.fails("trajectory")) {
    add_shifts(symptoms, hypotheses);
    return;
  }
  const bool is_inverse = symptoms.trial.dataset->format == "colmap";
  add_change(symptoms, hypotheses, "pose_inverted",
             is_inverse ? "are inverted (world_from_camera where camera_from_world is meant)"
             : symptoms.trial.dataset->format == "kitti"
                 ? "are inverted (first frame in each where each in the first is meant)"
                 : "are inverted (camera_from_world where world_from_camera is meant)",
             1, [](const Pose& row) { return row.inverse(); });
  add_change(symptoms, hypotheses, "pose_transposed", "have transposed rotations", 1,
             [](const Pose& row) {
               return Pose{row.rotation.transpose(), row.translation};
             });
  if (symptoms.trial.dataset->format != "kitti")
    add_change(symptoms, hypotheses, "quaternion_order",
               is_inverse ? "have quaternions that stand as x y z w where w x y z is meant"
                          : "have quaternions that stand as w x y z where x y z w is meant",
               1, [is_inverse](const Pose& row) {
                 const Eigen::Quaterniond q(row.rotation);
                 const Eigen::Quaterniond right =
                     is_inverse ? Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y())
                                : Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w());
                 return Pose{right.toRotationMatrix(), row.translation};
               });
  for (const Unit& unit : kUnits)
    add_change(
        symptoms, hypotheses, "pose_unit", unit.words, 1,
        [factor = unit.factor](const Pose& row) {
          return Pose{row.rotation, factor * row.translation};
        },
        1.0 / unit.factor, unit.unit);
  add_axes(symptoms, hypotheses);
  add_shifts(symptoms, hypotheses);
  add_rows(symptoms, hypotheses);
  add_float32(symptoms, hypotheses);
}

}  // namespace terracast::validate
