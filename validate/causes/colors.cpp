#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "validate/causes/trial.h"

/// Colours: order of channels, frames and single images; what compression left of them. Classes too.
namespace terracast::validate {

namespace {

const std::vector<std::string_view> kJudges = {"photometric", "stereo"};

void take_color(LoadedImage& image, const LoadedImage& from) {
  image.color = from.color;
  image.grey = from.grey;
}
void drop_color(LoadedImage& image) {
  image.color = {};
  image.grey = {};
}

/// Adds a hypothesis that lessens the disagreement of colours by half, of others it is not asked.
void add(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses, int rank,
         const std::function<bool(Trial&, Cause&)>& undo) {
  Trial tried = symptoms.trial;
  Cause ignored;
  if (!undo(tried, ignored)) return;
  if (color_disagreement(tried) > 0.8 * symptoms.color_disagreement()) return;
  hypotheses.push_back({kJudges, rank, undo});
}

void add_channels(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  // What plants look like tells of each camera; images that agree with each other, of none.
  const bool is_told = symptoms.fails_result("colors_plants");
  if (!symptoms.fails_result("photometric_channels") && !is_told) return;
  const std::vector<std::string_view> judges = {"photometric", "colors"};
  const Trial& trial = symptoms.trial;
  const std::vector<int> colored = colored_cameras(trial);
  const auto swap_channels = [](std::vector<int> cameras) {
    return [cameras](Trial& t, Cause& cause) {
      for (const int c : cameras)
        for (int f = 0; f < t.num_frames(); ++f) {
          core::Image8& color = t.edit(c, f).color;
          for (std::size_t i = 0; i + 2 < color.data().size(); i += 3)
            std::swap(color.data()[i], color.data()[i + 2]);
        }
      cause.name = "channel_order";
      cause.camera = cameras.size() == 1 ? t.camera(cameras[0]).name : "";
      cause.words = fmt::format("colours of {} stand in the order blue, green, red (BGR)",
                                t.camera_names(cameras));
      return true;
    };
  };
  // Of more than two cameras the odd one is wrong; of two the images do not tell which, but for grey ones beside them.
  const bool has_grey = static_cast<int>(colored.size()) < trial.num_cameras();
  if (colored.size() == 2 && !is_told) {
    Hypothesis h;
    h.checks = judges;
    h.rank = 3;
    h.undo = [=](Trial& t, Cause& cause) {
      swap_channels({colored[1]})(t, cause);
      cause.camera = "";
      cause.words = fmt::format(
          "colours of {} stand in different orders: one of them is blue, green, red (BGR)",
          t.camera_names(colored));
      return true;
    };
    hypotheses.push_back(std::move(h));
  }
  if (colored.size() != 2 || is_told || has_grey)
    for (const int c : colored) hypotheses.push_back({judges, 2, swap_channels({c})});
  if (colored.size() > 1) hypotheses.push_back({judges, 1, swap_channels(colored)});
}

void add_shifts(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  const Trial& trial = symptoms.trial;
  const std::vector<std::vector<int>> groups = groups_of_images(trial);
  for (const std::vector<int>& group : groups)
    for (const int shift : {1, -1})
      add(symptoms, hypotheses, 2 + (group.size() == groups[0].size() ? 0 : 1),
          [=](Trial& t, Cause& cause) {
            const auto old = t.images;
            for (const int c : group)
              for (int f = 0; f < t.num_frames(); ++f) {
                const int from = f + shift;
                LoadedImage& image = t.edit(c, f);
                if (from < 0 || from >= t.num_frames())
                  drop_color(image);
                else
                  take_color(image,
                             *old[static_cast<std::size_t>(from)][static_cast<std::size_t>(c)]);
              }
            cause.name = "color_shifted";
            cause.camera = group.size() == 1 ? t.camera(group[0]).name : "";
            cause.size = -shift;
            cause.unit = "frames";
            cause.words =
                fmt::format("colours of {} are shifted by 1 frame: each is that of the frame {}",
                            t.camera_names(group), shift > 0 ? "before" : "after");
            return true;
          });
}

bool is_same(const core::Image8& a, const core::Image8& b) {
  return a.data().size() == b.data().size() && !a.empty() &&
         std::memcmp(a.data().data(), b.data().data(), a.data().size_bytes()) == 0;
}

/// Cameras and frames of the trial that failed results on colours name.
std::vector<std::pair<int, int>> suspects(const Symptoms& symptoms) {
  std::vector<std::pair<int, int>> list;
  const auto note = [&](int camera, int frame) {
    const std::pair<int, int> place{camera, frame};
    if (frame >= 0 && frame < symptoms.trial.num_frames() &&
        std::find(list.begin(), list.end(), place) == list.end())
      list.push_back(place);
  };
  // Texts name frames of the whole sequence.
  Sequence names;
  names.num_frames = symptoms.trial.first_frame + symptoms.trial.num_frames();
  for (const Camera& camera : symptoms.trial.sequence.cameras) {
    names.cameras.emplace_back();
    names.cameras.back().name = camera.name;
  }
  for (const CheckResult& result : symptoms.failed)
    if (result.name.starts_with("photometric") || result.name.starts_with("stereo"))
      for (const auto& [camera, frame] : places_in(result.worst, names))
        note(camera, frame - symptoms.trial.first_frame);
  constexpr int kFew = 8;
  if (list.empty() && symptoms.trial.num_cameras() * symptoms.trial.num_frames() <= kFew)
    for (int c = 0; c < symptoms.trial.num_cameras(); ++c)
      for (int f = 0; f < symptoms.trial.num_frames(); ++f) note(c, f);
  return list;
}

/// From one frame on the images are those of the next frame.
void add_drops(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  std::vector<int> cameras;
  for (const auto& [camera, frame] : suspects(symptoms))
    if (std::find(cameras.begin(), cameras.end(), camera) == cameras.end())
      cameras.push_back(camera);
  for (const int c : cameras)
    for (int k = 1; k + 1 < symptoms.trial.num_frames(); ++k)
      add(symptoms, hypotheses, 5, [=](Trial& t, Cause& cause) {
        const auto old = t.images;
        for (int f = k; f < t.num_frames(); ++f) {
          LoadedImage& image = t.edit(c, f);
          if (f == k)
            drop_color(image);
          else
            take_color(image, *old[static_cast<std::size_t>(f - 1)][static_cast<std::size_t>(c)]);
        }
        cause.name = "frame_dropped";
        cause.camera = t.camera(c).name;
        cause.frame = t.first_frame + k;
        cause.words = fmt::format(
            "frame {} of {} is dropped: from there on colours are those of the next frame",
            cause.frame, cause.camera);
        return true;
      });
}

/// One image that is another's.
void add_single(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  std::vector<std::pair<int, int>> places = suspects(symptoms);
  // An image that stands twice is suspect whatever the texts name.
  for (int c = 0; c < symptoms.trial.num_cameras(); ++c)
    for (int f = 0; f + 1 < symptoms.trial.num_frames(); ++f)
      if (is_same(symptoms.trial.image(c, f).color, symptoms.trial.image(c, f + 1).color))
        for (const int frame : {f, f + 1})
          if (std::find(places.begin(), places.end(), std::pair(c, frame)) == places.end())
            places.emplace_back(c, frame);
  for (const auto& place : places)
    hypotheses.push_back(
        {kJudges, 7, [place](Trial& t, Cause& cause) {
           const auto [c, f] = place;
           int twin = -1;
           for (int other = 0; other < t.num_frames(); ++other)
             if (other != f && is_same(t.image(c, other).color, t.image(c, f).color)) twin = other;
           drop_color(t.edit(c, f));
           cause.name = twin >= 0 ? "frame_duplicated" : "frame_foreign";
           cause.camera = t.camera(c).name;
           cause.frame = t.first_frame + f;
           cause.words = twin >= 0 ? fmt::format(
                                         "image of {}, frame {} is duplicated: it is "
                                         "that of frame {}",
                                         cause.camera, cause.frame, t.first_frame + twin)
                                   : fmt::format(
                                         "image of {}, frame {} does not belong there: "
                                         "its colours agree with no other",
                                         cause.camera, cause.frame);
           return true;
         }});
}

void add_mirrors(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  const std::vector<std::vector<int>> groups = groups_of_images(symptoms.trial);
  for (const std::vector<int>& group : groups)
    for (const bool is_left_right : {true, false})
      add(symptoms, hypotheses, 2 + (group.size() == groups[0].size() ? 0 : 1),
          [=](Trial& t, Cause& cause) {
            const auto mirror = [&](auto& image) {
              const auto old = image;
              for (int y = 0; y < image.height(); ++y)
                for (int x = 0; x < image.width(); ++x)
                  for (int k = 0; k < image.channels(); ++k)
                    image(x, y, k) = is_left_right ? old(image.width() - 1 - x, y, k)
                                                   : old(x, image.height() - 1 - y, k);
            };
            for (const int c : group)
              for (int f = 0; f < t.num_frames(); ++f) {
                LoadedImage& image = t.edit(c, f);
                if (image.color.empty()) continue;
                mirror(image.color);
                mirror(image.grey);
              }
            cause.name = "color_flipped";
            cause.camera = group.size() == 1 ? t.camera(group[0]).name : "";
            cause.words =
                fmt::format("images of {} {}", t.camera_names(group),
                            is_left_right ? "are mirrored left to right" : "stand upside down");
            return true;
          });
}

void add_losses(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  if (symptoms.fails_result("colors_levels")) {
    Hypothesis h;
    h.checks = {"colors"};
    h.marks = {"colors", "photometric", "stereo"};
    h.undo = [](Trial& t, Cause& cause) {
      std::array<bool, 256> is_used{};
      for (int c = 0; c < t.num_cameras(); ++c)
        for (int f = 0; f < t.num_frames(); ++f)
          for (const std::uint8_t value : t.image(c, f).color.data()) is_used[value] = true;
      const auto count = std::count(is_used.begin(), is_used.end(), true);
      cause.name = "color_levels";
      cause.size = static_cast<double>(count);
      cause.unit = "levels";
      cause.words = fmt::format("colours are quantised: {} of 256 levels only", count);
      return true;
    };
    hypotheses.push_back(std::move(h));
  }
  if (symptoms.fails_result("colors_blocks")) {
    Hypothesis h;
    h.checks = {"colors"};
    h.rank = 1;
    h.marks = {"colors", "photometric", "stereo"};
    h.undo = [](Trial&, Cause& cause) {
      cause.name = "color_jpeg";
      cause.words = "colours were compressed as by JPEG: blocks of 8 x 8 pixels show";
      return true;
    };
    hypotheses.push_back(std::move(h));
  }
}

/// Classes that are numbered otherwise, in all images or in one.
void add_classes(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  if (!symptoms.fails("segmentation") && !symptoms.fails_result("structure")) return;
  const Trial& trial = symptoms.trial;
  int sky = -1;
  for (const auto& [index, name] : trial.sequence.classes)
    if (name == "sky") sky = index;
  // The class that stands where there is no depth is the sky, whatever it is called.
  std::map<int, std::size_t> without_depth;
  std::size_t num_without = 0;
  for (int c = 0; c < trial.num_cameras(); ++c)
    for (int f = 0; f < trial.num_frames(); ++f) {
      const LoadedImage& image = trial.image(c, f);
      if (image.segmentation.empty() || image.depth.empty()) continue;
      for (std::size_t i = 0; i < image.segmentation.data().size(); ++i)
        if (!std::isfinite(image.depth.data()[i])) {
          ++without_depth[image.segmentation.data()[i]];
          ++num_without;
        }
    }
  const auto name_of = [classes = trial.sequence.classes](int index) {
    const auto found = classes.find(index);
    return found == classes.end() ? fmt::format("{}", index) : found->second;
  };
  for (const auto& [index, count] : without_depth)
    if (sky >= 0 && index != sky && 20 * count > 19 * num_without &&
        symptoms.fails_result("structure")) {
      // Found by reading alone: nothing else of the trial fails, so that it says so itself.
      Hypothesis h;
      h.checks = {"structure"};
      h.marks = {"structure", "segmentation"};
      const int found = index;
      h.undo = [=](Trial&, Cause& cause) {
        cause.name = "classes_permuted";
        cause.explains = kUnfitClass;
        cause.words = fmt::format(
            "classes of the segmentation are permuted: the sky is called '{}'", name_of(found));
        return true;
      };
      hypotheses.push_back(std::move(h));
    }
  if (!symptoms.fails("segmentation")) return;
  for (int c = 0; c < trial.num_cameras(); ++c)
    for (int f = 0; f < trial.num_frames(); ++f) {
      if (trial.image(c, f).segmentation.empty()) continue;
      Hypothesis h;
      h.checks = {"segmentation"};
      h.rank = 3;
      h.undo = [c, f](Trial& t, Cause& cause) {
        t.edit(c, f).segmentation = {};
        cause.name = "classes_of_frame";
        cause.explains = {t.camera(c).files[static_cast<std::size_t>(f)].segmentation +
                          kUnfitClass[0]};
        cause.camera = t.camera(c).name;
        cause.frame = t.first_frame + f;
        cause.words = fmt::format("classes of {}, frame {} are permuted or another image's",
                                  cause.camera, cause.frame);
        return true;
      };
      hypotheses.push_back(std::move(h));
    }
}

}  // namespace

void make_colors_causes(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  add_classes(symptoms, hypotheses);
  if (symptoms.fails("colors")) add_losses(symptoms, hypotheses);
  add_channels(symptoms, hypotheses);
  if (!symptoms.fails("photometric") && !symptoms.fails("stereo")) return;
  // An image in a wrong place does not look like what is there.
  // The few patches of a trial may not show it.
  const auto fails = [&](const char* name) {
    const auto share = symptoms.shares.find(name);
    return symptoms.fails_result(name) || (share != symptoms.shares.end() && share->second > 1.0);
  };
  if (!fails("photometric_correlation") && !fails("photometric_frames") &&
      !fails("photometric_frame_shift") && !fails("photometric_shift") && !fails("stereo_shift"))
    return;
  // A shift of all images shows in more than single images. Half of a bound is enough of a hint.
  const auto is_of_all = [](std::string_view name) {
    return (name.starts_with("photometric") || name.starts_with("stereo")) &&
           name != "photometric_frames" && name != "photometric_frame_shift";
  };
  const bool has_of_all =
      std::any_of(symptoms.failed.begin(), symptoms.failed.end(),
                  [&](const CheckResult& result) {
                    // Some patches of a neighbouring frame still match; in steady flight all other
                    // frames may look right whether or not they are shifted.
                    constexpr double kMostOfNextFrame = 0.7;
                    return is_of_all(result.name) ||
                           (result.name == "photometric_frames" && result.value < kMostOfNextFrame);
                  }) ||
      std::any_of(symptoms.shares.begin(), symptoms.shares.end(), [&](const auto& share) {
        constexpr double kEnough = 0.5,
                         kEnoughUnlike = 0.9;  // correlations of right images are 0.6 to 1
        return is_of_all(share.first) &&
               share.second > (share.first == "photometric_correlation" ? kEnoughUnlike : kEnough);
      });
  if (has_of_all) add_shifts(symptoms, hypotheses);
  add_drops(symptoms, hypotheses);
  add_single(symptoms, hypotheses);
  add_mirrors(symptoms, hypotheses);
}

}  // namespace terracast::validate
