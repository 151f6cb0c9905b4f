#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <set>

#include "validate/causes/trial.h"
#include "validate/sequence_part.h"

/// What belongs to one frame stands at another: colours, depths, flow and poses backwards, sorted as words, or some of
/// them exchanged.
namespace terracast::validate {

namespace {

/// Where each frame's data stand, of all frames of a sequence or of a trial's.
struct Order {
  std::vector<int> place_of_frame;
  int first_frame = 0;  ///< in the sequence
  std::string words;    ///< "the last frame comes first"

  bool operator==(const Order& other) const = default;
};

/// The whole sequence of which a trial has some frames; null: the dataset holds none of that path.
const Sequence* whole_of(const Trial& trial) {
  for (const Sequence& sequence : trial.dataset->sequences)
    if (sequence.path == trial.sequence.path) return &sequence;
  return nullptr;
}

/// Index of a trial's camera among the sequence's.
std::size_t index_in(const Sequence& whole, const Camera& camera) {
  return static_cast<std::size_t>(whole.camera_index(camera.name));
}

/// "those of frames 4 and 5 are exchanged", "frames 0, 1 and 2 have those of 2, 0 and 1".
std::string words_of(const std::vector<int>& frame_at, int first_frame) {
  std::vector<int> moved;
  for (int at = 0; at < static_cast<int>(frame_at.size()); ++at)
    if (frame_at[static_cast<std::size_t>(at)] != at) moved.push_back(at);
  if (moved.size() == 2)
    return fmt::format("those of frames {} and {} are exchanged", first_frame + moved[0],
                       first_frame + moved[1]);
  std::string places, frames;
  for (const int at : moved) {
    places += fmt::format("{}{}", places.empty() ? "" : ", ", first_frame + at);
    frames += fmt::format("{}{}", frames.empty() ? "" : ", ",
                          first_frame + frame_at[static_cast<std::size_t>(at)]);
  }
  return fmt::format("frames {} have those of frames {}", places, frames);
}

std::vector<int> inverse_of(const std::vector<int>& order) {
  std::vector<int> inverse(order.size());
  for (std::size_t i = 0; i < order.size(); ++i)
    inverse[static_cast<std::size_t>(order[i])] = static_cast<int>(i);
  return inverse;
}

/// Orders of whole sequences that programs make: backwards, and by numbers sorted as words.
std::vector<Order> known_orders(int num_frames) {
  Order backwards{std::vector<int>(static_cast<std::size_t>(num_frames)), 0,
                  "the last frame comes first"};
  for (int f = 0; f < num_frames; ++f)
    backwards.place_of_frame[static_cast<std::size_t>(f)] = num_frames - 1 - f;
  constexpr int kFirstOfTwoDigits = 10;
  if (num_frames <= kFirstOfTwoDigits) return {std::move(backwards)};
  std::vector<int> sorted(static_cast<std::size_t>(num_frames));
  std::iota(sorted.begin(), sorted.end(), 0);
  std::sort(sorted.begin(), sorted.end(),
            [](int a, int b) { return std::to_string(a) < std::to_string(b); });
  return {std::move(backwards),
          {inverse_of(sorted), 0, "their numbers are sorted as words (0, 1, 10, 11, …, 2)"}};
}

/// Images of the frames at which a trial's frames stand.
std::vector<FrameImages> images_by(const Trial& trial, const Order& order, int num_frames) {
  const auto is_of_trial = [&](int place) {
    return place >= trial.first_frame && place < trial.first_frame + trial.num_frames();
  };
  const Sequence& whole = *whole_of(trial);
  std::vector<int> cameras;
  for (const Camera& camera : trial.sequence.cameras)
    cameras.push_back(static_cast<int>(index_in(whole, camera)));
  std::vector<FrameImages> images;
  for (int f = 0; f < num_frames; ++f) {
    const auto entry = static_cast<std::size_t>(trial.first_frame + f - order.first_frame);
    const int place = order.first_frame + order.place_of_frame[entry];
    if (is_of_trial(place)) {
      images.push_back(trial.images[static_cast<std::size_t>(place - trial.first_frame)]);
      continue;
    }
    Findings ignored;
    const Sequence part = part_of(whole, place, 1, cameras);
    images.push_back(load_frame(*trial.dataset, part, 0, ignored));
  }
  return images;
}

/// Puts what is taken from images of one order into those of the trial, of some cameras.
using Take = void (*)(LoadedImage& image, const LoadedImage& from);
void put_in_order(Trial& trial, const Order& order, const std::vector<int>& cameras, Take take,
                  int num_frames) {
  const std::vector<FrameImages> right = images_by(trial, order, num_frames);
  for (const int c : cameras)
    for (int f = 0; f < num_frames; ++f)
      take(trial.edit(c, f), *right[static_cast<std::size_t>(f)][static_cast<std::size_t>(c)]);
}

void take_color(LoadedImage& image, const LoadedImage& from) {
  image.color = from.color;
  image.grey = from.grey;
}
void take_depth(LoadedImage& image, const LoadedImage& from) {
  image.depth = from.depth;
  image.moving_depth = from.moving_depth;
}
void take_flow(LoadedImage& image, const LoadedImage& from) { image.flow = from.flow; }

/// Images that may be in another order, and how neighbouring frames tell that they are not.
struct Kind {
  const char* what;
  const char* name;  ///< of the cause
  Take take;
  double (*disagreement)(const Trial&);
  double least;  ///< of frames that may stand elsewhere
  double most;   ///< of frames that stand where they belong, whatever else is wrong with them
  std::vector<std::string_view> checks;
};
const Kind kColors = {
    "colours", "color_order", take_color, color_disagreement, 0.5, 0.5, {"photometric", "stereo"}};
const Kind kDepths = {
    "depths",
    "depth_order",
    take_depth,
    depth_disagreement,
    0.002,  // as `reprojection` allows
    0.05,
    {"reprojection", "flow", "stereo", "photometric", "segmentation", "colmap_point_depths"}};

/// What neighbouring frames of a trial disagree by, whatever images they have.
class NeighbourCosts {
 public:
  NeighbourCosts(const Trial& trial, int camera, const Kind& kind)
      : count_(trial.num_frames()),
        costs_(static_cast<std::size_t>(count_ * count_ * count_), 0.0) {
    for (int a = 0; a + 1 < count_; ++a) {
      Trial two = trial;
      two.sequence = part_of(trial.sequence, a, 2, {camera});
      const auto image_at = [&](int frame) {
        return trial.images[static_cast<std::size_t>(frame)][static_cast<std::size_t>(camera)];
      };
      for (int i = 0; i < count_; ++i)
        for (int k = 0; k < count_; ++k) {
          if (i == k) continue;
          two.images = {{image_at(a)}, {image_at(a + 1)}};
          kind.take(two.edit(0, 0), trial.image(camera, i));
          kind.take(two.edit(0, 1), trial.image(camera, k));
          costs_[index(a, i, k)] = kind.disagreement(two);
        }
    }
  }
  double sum(const std::vector<int>& order) const {
    double sum = 0.0;
    for (int a = 0; a + 1 < count_; ++a) sum += cost(order, a);
    return sum;
  }
  double largest(const std::vector<int>& order) const {
    double largest = 0.0;
    for (int a = 0; a + 1 < count_; ++a) largest = std::max(largest, cost(order, a));
    return largest;
  }

 private:
  std::size_t index(int a, int i, int k) const {
    return static_cast<std::size_t>((a * count_ + i) * count_ + k);
  }
  double cost(const std::vector<int>& order, int a) const {
    return costs_[index(a, order[static_cast<std::size_t>(a)],
                        order[static_cast<std::size_t>(a) + 1])];
  }

  int count_;
  std::vector<double> costs_;
};

/// Whether all neighbouring frames of a camera agree as they stand.
bool do_neighbours_agree(const Trial& trial, int camera, const Kind& kind) {
  for (int a = 0; a + 1 < trial.num_frames(); ++a) {
    Trial two = trial;
    two.sequence = part_of(trial.sequence, a, 2, {camera});
    two.images.clear();
    for (const int frame : {a, a + 1})
      two.images.push_back(
          {trial.images[static_cast<std::size_t>(frame)][static_cast<std::size_t>(camera)]});
    if (kind.disagreement(two) > kind.least) return false;
  }
  return true;
}

constexpr double kClearlyBetter = 0.8;

/// The order of a camera's images in which all neighbouring frames agree; nothing where they stand so, or where there is
/// nothing to tell by.
std::optional<Order> best_order(const Trial& trial, int camera, const Kind& kind) {
  if (trial.num_frames() < 2 || do_neighbours_agree(trial, camera, kind)) return std::nullopt;
  const NeighbourCosts costs(trial, camera, kind);
  std::vector<int> order(static_cast<std::size_t>(trial.num_frames()));
  std::iota(order.begin(), order.end(), 0);
  std::vector<int> best = order;
  const double as_it_is = costs.sum(order);
  double least = as_it_is;
  while (std::next_permutation(order.begin(), order.end()))
    if (const double sum = costs.sum(order); sum < least) {
      least = sum;
      best = order;
    }
  if (!(least < kClearlyBetter * as_it_is) || costs.largest(best) > kind.most) return std::nullopt;
  return Order{best, trial.first_frame, words_of(inverse_of(best), trial.first_frame)};
}

std::vector<int> all_cameras(const Trial& trial) {
  std::vector<int> all(static_cast<std::size_t>(trial.num_cameras()));
  std::iota(all.begin(), all.end(), 0);
  return all;
}

/// Orders that a sequence's images may have: those of programs, and what each camera's own frames tell.
std::vector<Order> orders_of(const Trial& trial, const Kind& kind) {
  std::vector<Order> orders = known_orders(whole_of(trial)->num_frames);
  for (int c = 0; c < trial.num_cameras(); ++c) {
    if (trial.image(c, 0).depth.empty()) continue;
    const auto order = best_order(trial, c, kind);
    if (order && std::find(orders.begin(), orders.end(), *order) == orders.end())
      orders.push_back(*order);
  }
  return orders;
}

void add_images(const Symptoms& symptoms, const Kind& kind, std::vector<Hypothesis>& hypotheses) {
  const Trial& trial = symptoms.trial;
  const double as_they_are = kind.disagreement(trial);
  const std::vector<std::vector<int>> groups = groups_of_images(trial);
  for (const Order& order : orders_of(trial, kind))
    for (const std::vector<int>& cameras : groups) {
      Trial tried = trial;
      put_in_order(tried, order, cameras, kind.take, trial.num_frames());
      if (kind.disagreement(tried) > kClearlyBetter * as_they_are) continue;
      Hypothesis h;
      h.checks = kind.checks;
      // An order keeps every image; a shift leaves frames at the ends without.
      h.rank = cameras.size() == groups[0].size() ? 0 : 1;
      h.undo = [=](Trial& t, Cause& cause) {
        put_in_order(t, order, cameras, kind.take, t.num_frames());
        cause.name = kind.name;
        cause.camera = cameras.size() == 1 ? t.camera(cameras[0]).name : "";
        cause.explains = kUnfitDepth;
        cause.explains.insert(cause.explains.end(), kUnfitClass.begin(), kUnfitClass.end());
        cause.words = fmt::format("{} of {} stand in another order: {}", kind.what,
                                  t.camera_names(cameras), order.words);
        return true;
      };
      hypotheses.push_back(std::move(h));
    }
}

/// Flow of pairs of frames, which are one fewer than frames.
void add_flow(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  const Sequence* whole = whole_of(symptoms.trial);
  if (whole == nullptr || whole->num_frames < 3 || symptoms.trial.num_frames() < 2) return;
  std::vector<Order> orders = known_orders(whole->num_frames - 1);
  // Of neighbouring pairs that a trial has, two are exchanged.
  const int num_pairs = symptoms.trial.num_frames() - 1;
  for (int first = 0; first < num_pairs; ++first)
    for (int second = first + 1; second < num_pairs; ++second) {
      Order order{std::vector<int>(static_cast<std::size_t>(num_pairs)), symptoms.trial.first_frame,
                  ""};
      std::iota(order.place_of_frame.begin(), order.place_of_frame.end(), 0);
      std::swap(order.place_of_frame[static_cast<std::size_t>(first)],
                order.place_of_frame[static_cast<std::size_t>(second)]);
      order.words = words_of(order.place_of_frame, order.first_frame);
      orders.push_back(std::move(order));
    }
  // What the files hold explains more than what might be made anew.
  int rank = 0;
  for (const Order& order : orders) {
    Hypothesis h;
    h.checks = {"flow"};
    h.rank = rank;
    h.undo = [=](Trial& t, Cause& cause) {
      put_in_order(t, order, all_cameras(t), take_flow, num_pairs);
      cause.name = "flow_order_of_frames";
      cause.words = fmt::format("flow of pairs of frames stands in another order: {}", order.words);
      return true;
    };
    hypotheses.push_back(std::move(h));
    rank = 1;
  }
}

// ---------------------------------------------------------------- poses

/// A camera and a frame of the whole sequence.
using Image = std::pair<std::size_t, std::size_t>;
/// The image at which each of a trial's has its pose in the file; by camera, then frame.
using PosePlaces = std::vector<std::vector<Image>>;

bool is_same(const Pose& a, const Pose& b) {
  constexpr double kTolerance_m = 2e-3, kTolerance = 2e-5;
  return (a.translation - b.translation).norm() < kTolerance_m &&
         (a.rotation - b.rotation).norm() < kTolerance;
}

/// The image whose pose in the file is that of georeference.csv's row.
std::optional<Image> place_of(const Sequence& whole, const Georeference& row) {
  const Pose local_from_ecef = ecef_from_local(whole.origin).inverse();
  const Pose right =
      local_from_ecef * Pose{enu_from_ecef(row.place).transpose() * row.enu_from_camera,
                             ecef_from_geodetic(row.place)};
  for (std::size_t c = 0; c < whole.cameras.size(); ++c) {
    const auto& poses = whole.cameras[c].local_from_camera;
    if (whole.cameras[c].georeference.empty()) continue;
    for (std::size_t f = 0; f < poses.size(); ++f)
      if (poses[f] && is_same(*poses[f], right)) return Image{c, f};
  }
  return std::nullopt;
}

/// Nothing unless all poses are in the file once, and some of them elsewhere; nor where all are so many frames later.
std::optional<PosePlaces> find_poses(const Trial& trial, const Sequence& whole) {
  PosePlaces places(trial.sequence.cameras.size());
  std::set<Image> taken;
  std::set<std::ptrdiff_t> shifts;
  for (std::size_t c = 0; c < places.size(); ++c) {
    const Camera& camera = trial.sequence.cameras[c];
    const std::size_t own = index_in(whole, camera);
    for (std::size_t f = 0; f < camera.local_from_camera.size(); ++f) {
      const auto frame = f + static_cast<std::size_t>(trial.first_frame);
      // Cameras that georeference.csv does not speak of (KITTI's grey ones) go with the first.
      if (f >= camera.georeference.size() || !camera.georeference[f]) {
        if (c == 0 || f >= places[0].size()) return std::nullopt;
        places[c].emplace_back(own, places[0][f].second);
        continue;
      }
      const auto place = place_of(whole, *camera.georeference[f]);
      if (!place || !taken.insert(*place).second) return std::nullopt;
      shifts.insert(static_cast<std::ptrdiff_t>(place->second) -
                    static_cast<std::ptrdiff_t>(frame));
      places[c].push_back(*place);
    }
  }
  return shifts.size() > 1 ? std::optional(places) : std::nullopt;
}

std::string words_of(const PosePlaces& places, const Trial& trial, const Sequence& whole) {
  bool is_backwards = true, is_of_own_camera = true;
  std::vector<int> place_of_frame;
  for (std::size_t c = 0; c < places.size(); ++c)
    for (std::size_t f = 0; f < places[c].size(); ++f) {
      const auto [camera, frame] = places[c][f];
      is_of_own_camera = is_of_own_camera && camera == index_in(whole, trial.sequence.cameras[c]);
      is_backwards =
          is_backwards &&
          static_cast<int>(frame) + trial.first_frame + static_cast<int>(f) == whole.num_frames - 1;
      if (c == 0) place_of_frame.push_back(static_cast<int>(frame) - trial.first_frame);
    }
  if (is_of_own_camera && is_backwards) return "stand in another order: the last frame comes first";
  const int count = static_cast<int>(place_of_frame.size());
  const bool is_within = std::all_of(place_of_frame.begin(), place_of_frame.end(),
                                     [&](int at) { return at >= 0 && at < count; });
  if (is_of_own_camera && is_within)
    return "stand in another order: " + words_of(inverse_of(place_of_frame), trial.first_frame);
  for (std::size_t c = 0; c < places.size(); ++c)
    for (std::size_t f = 0; f < places[c].size(); ++f) {
      const std::string own = fmt::format("{}, frame {}", trial.sequence.cameras[c].name,
                                          trial.first_frame + static_cast<int>(f));
      const std::string place =
          fmt::format("{}, frame {}", whole.cameras[places[c][f].first].name, places[c][f].second);
      if (own != place) return fmt::format("are permuted: that of {} stands at {}", own, place);
    }
  return "";
}

void add_poses(std::vector<Hypothesis>& hypotheses) {
  Hypothesis h;
  h.checks = {"georeference", "reprojection", "calibration", "trajectory", "colmap_observations"};
  h.rank = 1;
  h.undo = [](Trial& trial, Cause& cause) {
    const Sequence* whole = whole_of(trial);
    if (whole == nullptr) return false;
    const auto places = find_poses(trial, *whole);
    if (!places) return false;
    for (std::size_t c = 0; c < places->size(); ++c)
      for (std::size_t f = 0; f < (*places)[c].size(); ++f) {
        const auto [camera, frame] = (*places)[c][f];
        trial.sequence.cameras[c].local_from_camera[f] =
            whole->cameras[camera].local_from_camera[frame];
      }
    cause.name = "pose_order";
    cause.words =
        fmt::format("poses{} {}", trial.dataset->format == "colmap" ? " of images.bin" : "",
                    words_of(*places, trial, *whole));
    return true;
  };
  hypotheses.push_back(std::move(h));
}

/// KITTI raw: the poses beside the packets, whose first is the identity.
void add_stated_poses(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  if (symptoms.trial.sequence.first_from_camera0.empty()) return;
  Hypothesis h;
  h.checks = {"oxts"};
  h.rank = 1;
  h.undo = [](Trial& trial, Cause& cause) {
    const Sequence* whole = whole_of(trial);
    if (whole == nullptr || !whole->oxts[0]) return false;
    const Pose camera0_from_imu = whole->camera0_from_imu;
    const Pose first_from_ecef =
        (whole->oxts[0]->ecef_from_imu() * camera0_from_imu.inverse()).inverse();
    std::vector<int> place_of_frame;
    std::vector<Pose> right;
    for (int f = 0; f < trial.num_frames(); ++f) {
      const auto& packet = trial.sequence.oxts[static_cast<std::size_t>(f)];
      if (!packet) return false;
      right.push_back(first_from_ecef * packet->ecef_from_imu() * camera0_from_imu.inverse());
      const auto place =
          std::find_if(whole->first_from_camera0.begin(), whole->first_from_camera0.end(),
                       [&](const Pose& pose) { return is_same(pose, right.back()); });
      if (place == whole->first_from_camera0.end()) return false;
      place_of_frame.push_back(
          static_cast<int>(std::distance(whole->first_from_camera0.begin(), place)));
    }
    std::vector<int> distinct = place_of_frame;
    std::sort(distinct.begin(), distinct.end());
    const bool is_once = std::adjacent_find(distinct.begin(), distinct.end()) == distinct.end();
    PosePlaces places(1);
    for (const int place : place_of_frame) places[0].emplace_back(0, place);
    const Pose first_from_right = right[0].inverse();
    for (std::size_t f = 0; f < right.size(); ++f)
      trial.sequence.first_from_camera0[f] = first_from_right * right[f];
    cause.name = "pose_order";
    cause.words = "poses.txt: poses " + words_of(places, trial, *whole);
    std::vector<int> shifts;
    for (int f = 0; f < trial.num_frames(); ++f)
      shifts.push_back(place_of_frame[static_cast<std::size_t>(f)] - trial.first_frame - f);
    const bool is_shift =
        std::all_of(shifts.begin(), shifts.end(), [&](int shift) { return shift == shifts[0]; });
    return is_once && !is_shift;
  };
  hypotheses.push_back(std::move(h));
}

}  // namespace

void make_order_causes(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  if (whole_of(symptoms.trial) == nullptr) return;
  if (symptoms.fails("oxts")) add_stated_poses(symptoms, hypotheses);
  if (symptoms.fails("georeference")) add_poses(hypotheses);
  if (symptoms.fails("flow")) add_flow(symptoms, hypotheses);
  if (symptoms.fails("reprojection")) add_images(symptoms, kDepths, hypotheses);
  if (symptoms.fails("photometric") || symptoms.fails("stereo"))
    add_images(symptoms, kColors, hypotheses);
}

}  // namespace terracast::validate
