#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "validate/checks/photometric_pairs.h"

namespace terracast::validate {

/// Single images beside the others of their camera: one that is of another place is lost in the medians of all.
class SingleImages {
 public:
  explicit SingleImages(bool is_trial) : is_trial_(is_trial) {}

  /// Adds the patches of a pair to both of its images.
  void add(const ViewPair& pair, const PairMatches& matches);
  /// No more pairs come with images of frames before this one.
  void finish_before(int frame);
  /// photometric_frames and photometric_frame_shift.
  std::vector<CheckResult> results(const Sequence& sequence);

 private:
  /// Frame, camera, and whether of pairs of one time, which may be foreign together.
  using Key = std::array<int, 3>;
  struct Pool {
    std::string name;
    PairMatches matches;
  };
  /// Patches, and how many of them are unlike.
  struct Count {
    std::int64_t unlike = 0, all = 0;
    double share() const { return static_cast<double>(unlike) / static_cast<double>(all); }
  };
  /// What all pairs with one image say.
  struct Image {
    Key key;
    std::string name;
    Likeness likeness;
    Count patches;
    std::int64_t num_facts = 1;  ///< patches, as many as are independent of each other
    double shift_px = 0.0;       ///< what of it is sure
    double unsure_px = 0.0;      ///< what either component may be off by
    bool has_shift = false;
  };
  /// Patches that an image shares with each other image.
  using Links = std::map<Key, Count>;

  void set_shift(PairMatches& matches, Image& image) const;
  void sort_images();
  double typical_share(const Image& image) const;
  std::optional<double> bound_of(const Image& image) const;
  std::int64_t num_unlike_of_all(const Image& image) const;
  bool tells_another(const Image& image) const;
  CheckResult unlike_result(const Sequence& sequence) const;
  CheckResult shift_result() const;

  bool is_trial_;
  std::map<Key, Pool> pools_;  ///< of images that still meet others
  std::vector<Image> images_;
  std::map<Key, Links> links_;
  /// When all are known: images by key, and the shares of unlike patches of a camera's images, least first.
  std::map<Key, const Image*> by_key_;
  std::map<std::array<int, 2>, std::vector<double>> shares_;
};

}  // namespace terracast::validate
