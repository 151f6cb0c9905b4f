#include "validate/readers/coco.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "core/error.h"
#include "core/json.h"
#include "core/printable.h"
#include "core/semantic_class.h"
#include "validate/readers/single_images.h"
#include "validate/readers/stated_model.h"

namespace terracast::validate {
namespace {

using core::ErrorKind;
using core::fail;
using core::Json;

constexpr const char* kInstances = "annotations/instances.json";
constexpr const char* kPanoptic = "annotations/panoptic.json";

/// What a segment of pixels is.
struct Area {
  std::int64_t count = 0;
  int left = 0, top = 0, right = 0, bottom = 0;  ///< the last ones included

  void add(int x, int y) {
    if (count++ == 0) {
      left = right = x;
      top = bottom = y;
    }
    left = std::min(left, x);
    right = std::max(right, x);
    top = std::min(top, y);
    bottom = std::max(bottom, y);
  }
};

/// throws   Input: the area or the box that is stated is another
void check_area(const Json& stated, const Area& area, const std::string& where) {
  if (stated.at("area").number() != static_cast<double>(area.count))
    fail(ErrorKind::Input, "{}: area {} of {} pixels", where, stated.at("area").number(),
         area.count);
  const std::vector<double> wanted = {double(area.left), double(area.top),
                                      area.right - area.left + 1.0, area.bottom - area.top + 1.0};
  if (stated.at("bbox").numbers() != wanted)
    fail(ErrorKind::Input, "{}: its bbox is not that of its pixels, [{:g}, {:g}, {:g}, {:g}]",
         where, wanted[0], wanted[1], wanted[2], wanted[3]);
}

void check_no_crowd(const Json& stated, const std::string& where) {
  if (stated.at("iscrowd").integer() != 0)
    fail(ErrorKind::Input, "{}: iscrowd {}; each thing is listed by itself", where,
         stated.at("iscrowd").integer());
}

/// A panoptic image's numbers, and what each of them covers.
struct PanopticImage {
  core::ImageU32 numbers;
  std::map<std::uint32_t, Area> areas;
};

/// Whether a ray comes in at every place of a camera's image, so that things are cut off at its sides alone: neither at
/// the circle of a fisheye, nor where a panorama joins.
bool fills_its_image(const Intrinsics& camera) {
  if (!camera.plane) return true;
  if (!camera.plane->is_central() || camera.plane->turn() != 0.0) return false;
  const auto has_ray = [&](double u, double v) {
    return camera.ray_from_pixel({u, v}).allFinite();
  };
  for (const double u : {0.0, double(camera.width_px)})
    for (const double v : {0.0, double(camera.height_px)})
      if (!has_ray(u, v)) return false;
  for (int y = 0; y < camera.height_px; ++y)
    for (int x = 0; x < camera.width_px; ++x)
      if (!has_ray(x + 0.5, y + 0.5)) return false;
  return true;
}

/// What is said of all of the thing, against the pixels that show it: these lie within the box around all, which lies
/// within the image; of a camera that fills its image, what is cut off at no side of it is not truncated.
/// throws   Input: what contradicts
void check_whole(const Json& stated, const Area& area, const PanopticImage& image, bool is_filled,
                 const std::string& where) {
  if (!stated.has("whole_bbox")) return;
  const std::vector<double> box = stated.at("whole_bbox").numbers();
  const double occlusion = stated.at("occlusion").number();
  const double truncation = stated.at("truncation").number();
  if (box.size() != 4 || !(occlusion >= 0.0 && occlusion < 1.0) ||
      !(truncation >= 0.0 && truncation <= 1.0))
    fail(ErrorKind::Input, "{}: occlusion {}, truncation {} or a box of {} numbers", where,
         occlusion, truncation, box.size());
  const double width = image.numbers.width(), height = image.numbers.height();
  const double right = box[0] + box[2], bottom = box[1] + box[3];
  // A pixel shows what its centre meets, so that the thing reaches half a pixel at least into each.
  constexpr double kHalf = 0.5, kRounding_px = 1e-9;
  if (box[0] > area.left + kHalf + kRounding_px || box[1] > area.top + kHalf + kRounding_px ||
      right < area.right + kHalf - kRounding_px || bottom < area.bottom + kHalf - kRounding_px ||
      box[0] < -kRounding_px || box[1] < -kRounding_px || right > width + kRounding_px ||
      bottom > height + kRounding_px)
    fail(ErrorKind::Input, "{}: whole_bbox does not hold its pixels, or leaves the image", where);
  const bool is_at_border = box[0] <= kRounding_px || box[1] <= kRounding_px ||
                            right >= width - kRounding_px || bottom >= height - kRounding_px;
  if (is_filled && truncation > 0.0 && !is_at_border)
    fail(ErrorKind::Input, "{}: truncation {}, but whole_bbox meets no side of the image", where,
         truncation);
}

/// Decodes COCO's text of runs: groups of 5 bits and a mark that more follow, the lowest first, signed; from the
/// fourth run on less that two before.
/// throws   Input: no such text, or runs that do not fill `num_pixels`
std::vector<std::int64_t> decoded_runs(const std::string& text, std::int64_t num_pixels,
                                       const std::string& where) {
  std::vector<std::int64_t> runs;
  std::int64_t sum = 0;
  for (std::size_t at = 0; at < text.size();) {
    std::uint64_t bits = 0;
    int shift = 0;
    for (bool has_more = true; has_more; ++at) {
      if (at >= text.size() || text[at] < '0' || text[at] > 'o' || shift > 35)
        fail(ErrorKind::Input, "{}: counts are no text of runs (character {})", where, at);
      const auto group = static_cast<std::uint64_t>(text[at] - '0');
      bits |= (group & 31U) << shift;
      shift += 5;
      has_more = (group & 32U) != 0;
      if (!has_more && (group & 16U) != 0) bits |= ~std::uint64_t{0} << shift;
    }
    auto run = static_cast<std::int64_t>(bits);
    if (runs.size() > 2) run += runs[runs.size() - 2];
    if (run < 0 || run > num_pixels) fail(ErrorKind::Input, "{}: a run of {} pixels", where, run);
    runs.push_back(run);
    sum += run;
  }
  if (sum != num_pixels)
    fail(ErrorKind::Input, "{}: its runs fill {} of {} pixels", where, sum, num_pixels);
  return runs;
}

PanopticImage read_panoptic(const Dataset& dataset, const std::string& path,
                            const Intrinsics& size) {
  const core::Image8 png = read_png8(dataset.root / path, path, 3, size);
  PanopticImage image{.numbers = core::ImageU32(png.width(), png.height()), .areas = {}};
  for (int y = 0; y < png.height(); ++y)
    for (int x = 0; x < png.width(); ++x) {
      const std::uint32_t number =
          png(x, y, 0) + 256U * png(x, y, 1) + 65536U * static_cast<std::uint32_t>(png(x, y, 2));
      image.numbers(x, y) = number;
      if (number != 0) image.areas[number].add(x, y);
    }
  return image;
}

/// What the two files say of all sequences, by file name of the image.
class Annotations {
 public:
  Annotations(const Dataset& dataset, Findings& findings) : dataset_(dataset) {
    findings.attempt(kInstances, [&] {
      instances_ = Json::read(dataset.root / kInstances, Json::kMostOfDatasets);
      read_images();
      read_categories(instances_, instance_categories_);
      std::set<std::int64_t> ids;
      for (std::size_t i = 0; i < instances_.at("annotations").size(); ++i) {
        const Json& one = instances_.at("annotations").at(i);
        if (!ids.insert(one.at("id").integer()).second)
          fail(ErrorKind::Input, "{}: annotation {} stands twice", kInstances,
               one.at("id").integer());
        if (!file_of_id_.contains(one.at("image_id").integer()))
          fail(ErrorKind::Input, "{}: annotation {} is of no image", kInstances,
               one.at("id").integer());
        by_image_[one.at("image_id").integer()].push_back(&one);
      }
    });
    findings.attempt(kPanoptic, [&] {
      panoptic_ = Json::read(dataset.root / kPanoptic, Json::kMostOfDatasets);
      for (const char* member : {"images", "info", "licenses"})
        if (panoptic_.has(member) && panoptic_.at(member).text() != instances_.at(member).text())
          fail(ErrorKind::Input, "{}: other {} than in {}", kPanoptic, member, kInstances);
      read_categories(panoptic_, panoptic_categories_);
      check_things();
      for (std::size_t i = 0; i < panoptic_.at("annotations").size(); ++i) {
        const Json& one = panoptic_.at("annotations").at(i);
        const std::string& name = one.at("file_name").string();
        const auto file = file_of_id_.find(one.at("image_id").integer());
        if (file == file_of_id_.end() || file->second != name)
          fail(ErrorKind::Input, "{}: image_id {} is not that of {}", kPanoptic,
               one.at("image_id").integer(), core::first_letters(name, 100));
        segments_[name] = &one;
      }
    });
  }

  /// throws   Input: what is wrong with an image's annotations
  /// is_filled   of fills_its_image()
  void check(const std::string& name, const Intrinsics& size, bool is_filled) const {
    const auto segments = segments_.find(name);
    const auto id = image_ids_.find(name);
    if (id == image_ids_.end())
      fail(ErrorKind::Input, "{}: no image {}", kInstances, core::first_letters(name, 100));
    if (segments == segments_.end())
      fail(ErrorKind::Input, "{}: no annotation of {}", kPanoptic, core::first_letters(name, 100));
    const PanopticImage image = read_panoptic(dataset_, "panoptic/" + name, size);
    const Json& stated = *images_.at(name);
    if (stated.at("width").integer() != size.width_px ||
        stated.at("height").integer() != size.height_px)
      fail(ErrorKind::Input, "{}: {} x {} px of {}, not {} x {}", kInstances,
           stated.at("width").integer(), stated.at("height").integer(),
           core::first_letters(name, 100), size.width_px, size.height_px);
    const std::map<std::uint32_t, std::int64_t> categories =
        check_segments(*segments->second, image, name);
    const auto own = by_image_.find(id->second);
    if (own == by_image_.end()) return;
    for (const Json* annotation : own->second)
      check_instance(*annotation, image, is_filled, categories,
                     fmt::format("{}: annotation {}", kInstances, annotation->at("id").integer()));
  }

 private:
  /// Images have the names of their sequences, cameras and frames.
  void read_images() {
    for (std::size_t i = 0; i < instances_.at("images").size(); ++i) {
      const Json& image = instances_.at("images").at(i);
      const std::string& name = image.at("file_name").string();
      image_ids_[name] = image.at("id").integer();
      if (!file_of_id_.emplace(image.at("id").integer(), name).second)
        fail(ErrorKind::Input, "{}: image {} stands twice", kInstances, image.at("id").integer());
      images_[name] = &image;
      if (!image.has("frame")) continue;
      const std::string wanted =
          fmt::format("{}/{}/{}.png", image.at("sequence").string(), image.at("camera").string(),
                      frame_digits(static_cast<int>(image.at("frame").integer())));
      if (name != wanted)
        fail(ErrorKind::Input, "{}: {} is frame {} of {} in {}", kInstances,
             core::first_letters(name, 100), image.at("frame").integer(),
             core::first_letters(image.at("camera").string(), 60),
             core::first_letters(image.at("sequence").string(), 60));
    }
  }

  /// The categories of instances are those of the panoptic file that are things.
  void check_things() const {
    std::map<std::int64_t, std::string> things;
    for (std::size_t i = 0; i < panoptic_.at("categories").size(); ++i) {
      const Json& one = panoptic_.at("categories").at(i);
      check_category(one);
      if (one.at("isthing").integer() == 1)
        things[one.at("id").integer()] =
            one.at("name").string() + "/" + one.at("supercategory").string();
    }
    std::map<std::int64_t, std::string> listed;
    for (std::size_t i = 0; i < instances_.at("categories").size(); ++i) {
      const Json& one = instances_.at("categories").at(i);
      listed[one.at("id").integer()] =
          one.at("name").string() + "/" + one.at("supercategory").string();
    }
    if (listed != things)
      fail(ErrorKind::Input, "{}: its categories are not the things of {}", kInstances, kPanoptic);
  }

  /// A category of terracast's own classes has the class's number plus 1, its name, parent and colour; of COCO's, one
  /// of the classes that have that number has its colour.
  static void check_category(const Json& category) {
    const std::int64_t id = category.at("id").integer();
    const std::string& name = category.at("name").string();
    const auto fits = [&](const core::SemanticClassInfo& info) {
      const bool is_own = static_cast<std::int64_t>(info.id) + 1 == id && info.name == name &&
                          info.parent == category.at("supercategory").string() &&
                          info.is_thing == (category.at("isthing").integer() == 1);
      const std::vector<double> color(info.color_srgb.begin(), info.color_srgb.end());
      return (is_own || info.coco_id == id) && category.at("color").numbers() == color;
    };
    const auto classes = core::semantic_classes();
    if (std::none_of(classes.begin(), classes.end(), fits))
      fail(ErrorKind::Input, "{}: category {}, {}, is no class of terracast's and none of COCO's",
           kPanoptic, id, core::first_letters(name, 60));
  }

  static void read_categories(const Json& json, std::set<std::int64_t>& ids) {
    for (std::size_t i = 0; i < json.at("categories").size(); ++i)
      ids.insert(json.at("categories").at(i).at("id").integer());
  }

  /// returns   the category of each number
  std::map<std::uint32_t, std::int64_t> check_segments(const Json& annotation,
                                                       const PanopticImage& image,
                                                       const std::string& name) const {
    std::map<std::uint32_t, std::int64_t> categories;
    const Json& list = annotation.at("segments_info");
    for (std::size_t i = 0; i < list.size(); ++i) {
      const Json& segment = list.at(i);
      const std::string where = fmt::format("{}: {}, segment {}", kPanoptic, name, i);
      const std::int64_t number = segment.at("id").integer();
      const auto area = number > 0 && number < (1 << 24)
                            ? image.areas.find(static_cast<std::uint32_t>(number))
                            : image.areas.end();
      if (area == image.areas.end())
        fail(ErrorKind::Input, "{}: no pixel has its id {}", where, number);
      check_area(segment, area->second, where);
      check_no_crowd(segment, where);
      const std::int64_t category = segment.at("category_id").integer();
      if (!panoptic_categories_.contains(category))
        fail(ErrorKind::Input, "{}: category {} is not listed", where, category);
      if (!categories.emplace(static_cast<std::uint32_t>(number), category).second)
        fail(ErrorKind::Input, "{}: id {} stands twice", where, number);
    }
    for (const auto& [number, area] : image.areas)
      if (!categories.contains(number))
        fail(ErrorKind::Input, "{}: {}: {} pixels have the id {}, which is not listed", kPanoptic,
             name, area.count, number);
    return categories;
  }

  void check_instance(const Json& annotation, const PanopticImage& image, bool is_filled,
                      const std::map<std::uint32_t, std::int64_t>& categories,
                      const std::string& where) const {
    const std::int64_t category = annotation.at("category_id").integer();
    if (!instance_categories_.contains(category))
      fail(ErrorKind::Input, "{}: category {} is not listed", where, category);
    const Json& mask = annotation.at("segmentation");
    const int width = image.numbers.width();
    const int height = image.numbers.height();
    if (mask.at("size").numbers() != std::vector<double>{double(height), double(width)})
      fail(ErrorKind::Input, "{}: its size is not [{}, {}]", where, height, width);
    const std::vector<std::int64_t> runs =
        decoded_runs(mask.at("counts").string(), std::int64_t{width} * height, where);
    Area area;
    std::uint32_t number = 0;
    std::int64_t at = 0;
    for (std::size_t i = 0; i < runs.size(); ++i) {
      for (std::int64_t k = 0; i % 2 == 1 && k < runs[i]; ++k) {
        const int x = static_cast<int>((at + k) / height);
        const int y = static_cast<int>((at + k) % height);
        if (area.count > 0 && image.numbers(x, y) != number)
          fail(ErrorKind::Input,
               "{}: its mask holds pixels ({}, {}) of another segment of the panoptic image", where,
               x, y);
        number = image.numbers(x, y);
        area.add(x, y);
      }
      at += runs[i];
    }
    check_area(annotation, area, where);
    check_no_crowd(annotation, where);
    check_whole(annotation, area, image, is_filled, where);
    const auto segment = image.areas.find(number);
    if (segment == image.areas.end() || segment->second.count != area.count)
      fail(ErrorKind::Input, "{}: its mask is not the whole of segment {} of the panoptic image",
           where, number);
    check_number(annotation, number, where);
    if (categories.at(number) != category)
      fail(ErrorKind::Input, "{}: category {}, and {} in the panoptic image", where, category,
           categories.at(number));
  }

  /// Of a sequence a segment's number and an instance's are of one thing.
  void check_number(const Json& annotation, std::uint32_t number, const std::string& where) const {
    if (!annotation.has("instance_id")) return;
    const std::string& file = file_of_id_.at(annotation.at("image_id").integer());
    const std::string sequence = file.substr(0, file.find('/'));
    const std::int64_t id = annotation.at("instance_id").integer();
    if (!listed_.emplace(file, id).second)
      fail(ErrorKind::Input, "{}: instance_id {} stands twice in {}", where, id,
           core::first_letters(file, 100));
    const auto of_number = instance_of_number_.emplace(std::pair(sequence, number), id).first;
    const auto of_instance = number_of_instance_.emplace(std::pair(sequence, id), number).first;
    if (of_number->second != id || of_instance->second != number)
      fail(ErrorKind::Input, "{}: instance_id {} and segment {}, which belong to others elsewhere",
           where, id, number);
  }

  const Dataset& dataset_;
  mutable std::set<std::pair<std::string, std::int64_t>> listed_;
  mutable std::map<std::pair<std::string, std::uint32_t>, std::int64_t> instance_of_number_;
  mutable std::map<std::pair<std::string, std::int64_t>, std::uint32_t> number_of_instance_;
  std::map<std::int64_t, std::string> file_of_id_;
  std::map<std::string, const Json*> images_;
  Json instances_ = Json::object(), panoptic_ = Json::object();
  std::map<std::string, std::int64_t> image_ids_;
  std::map<std::int64_t, std::vector<const Json*>> by_image_;
  std::map<std::string, const Json*> segments_;
  std::set<std::int64_t> instance_categories_, panoptic_categories_;
};

}  // namespace

void CocoReader::read(const Dataset& dataset, Sequence& sequence, Findings& findings) const {
  take_georeferenced_poses(sequence);
  const Annotations annotations(dataset, findings);
  for (Camera& camera : sequence.cameras) {
    adopt_stated(camera, findings);  // the format has none
    const bool is_filled = fills_its_image(camera.intrinsics);
    const std::string folder = sequence.name + "/" + camera.name;
    const std::vector<std::string> images =
        numbered_files(dataset, "images/" + folder, ".png", sequence.num_frames, findings);
    for (int frame = 0; frame < sequence.num_frames; ++frame) {
      camera.files[static_cast<std::size_t>(frame)].color = images[static_cast<std::size_t>(frame)];
      const std::string name = folder + "/" + frame_digits(frame) + ".png";
      findings.attempt("panoptic/" + name,
                       [&] { annotations.check(name, camera.intrinsics, is_filled); });
    }
  }
}

core::ImageF CocoReader::depth(const Dataset& dataset, const Camera& camera, int) const {
  fail(ErrorKind::Internal, "{} holds no depth (asked for {})", dataset.format, camera.name);
}

}  // namespace terracast::validate
