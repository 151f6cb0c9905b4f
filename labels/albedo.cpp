// The colour of what each pixel shows, whatever the light: the share of light that its surface sends back, every way, in
// linear sRGB. Of each pixel's centre, with materials as wide as the pixel filtered. Of water it is what comes from below
// its surface; gloss is left out.
//
// An OpenEXR file an image: albedo.R, .G and .B (float), NaN of the sky and of pixels without a ray.

#include <algorithm>
#include <array>

#include "capture/labels.h"
#include "capture/object_labels.h"
#include "capture/sequence_files.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "core/random.h"
#include "core/stop.h"
#include "geo/frames.h"
#include "labels/label.h"
#include "labels/label_image.h"
#include "labels/matches.h"
#include "scene/light/hit_shader.h"
#include "scene/water/water_above.h"

namespace terracast::labels {
namespace {

namespace fs = std::filesystem;

constexpr int kBlockSide_px = 16;

/// Pixels of an image, block by block.
struct BlockedPixels {
  std::vector<Eigen::Vector2i> pixels;
  std::vector<std::size_t> begins;  ///< of the blocks, and the end
};

BlockedPixels blocked_pixels(int width_px, int height_px) {
  BlockedPixels all;
  for (int by = 0; by < height_px; by += kBlockSide_px)
    for (int bx = 0; bx < width_px; bx += kBlockSide_px) {
      all.begins.push_back(all.pixels.size());
      for (int y = by; y < std::min(by + kBlockSide_px, height_px); ++y)
        for (int x = bx; x < std::min(bx + kBlockSide_px, width_px); ++x)
          all.pixels.emplace_back(x, y);
    }
  all.begins.push_back(all.pixels.size());
  return all;
}

/// Of what rays met: the depth of the sea above its bed, 0 elsewhere; by it the image paints what
/// grows there.
std::vector<double> sea_depths_m(const world::RayQuery& whole,
                                 std::span<const world::WorldRay> rays,
                                 std::span<const world::SurfaceHit> hits,
                                 std::span<const world::SurfaceSample> surfaces) {
  std::vector<std::size_t> beds;
  std::vector<Eigen::Vector3d> places_world;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (hits[i].is_sky() || !hits[i].is_ground() || surfaces[i].cover != world::Cover::Seabed)
      continue;
    beds.push_back(i);
    places_world.push_back(rays[i].origin_world + hits[i].t * rays[i].direction_world);
  }
  std::vector<scene::WaterAbove> above(beds.size());
  scene::find_water_above(whole, places_world, above, nullptr);
  std::vector<double> depths_m(rays.size(), 0.0);
  for (std::size_t at = 0; at < beds.size(); ++at) depths_m[beds[at]] = above[at].sea_depth_m();
  return depths_m;
}

/// What the surfaces of a sequence's world are like.
struct Surfaces {
  Surfaces(const LabelInputs& inputs, double imagery_budget_bytes)
      : ground(scene::climate_of(inputs.store, static_cast<std::uint32_t>(
                                                   core::mix_bits(inputs.store.manifest().seed)))),
        imagery(inputs.store, imagery_budget_bytes),
        textures(inputs.store),
        looks(ground, imagery, textures),
        up(geo::WorldFrame(inputs.store.manifest().origin)
               .up_world(inputs.sequence.frames().front().world_from_body.translation)
               .cast<float>()) {}

  const scene::Ground ground;
  const scene::GroundImagery imagery;
  const scene::TextureLibrary textures;
  const scene::SurfaceLooks looks;
  const Eigen::Vector3f up;
};

class AlbedoLabel final : public LabelMaker {
 public:
  void describe(core::SchemaVisitor&) override {}
  std::unique_ptr<LabelMaker> clone() const override {
    return std::make_unique<AlbedoLabel>(*this);
  }

  LabelFiles make(const LabelInputs& inputs) const override {
    const capture::SequenceReader& sequence = inputs.sequence;
    const Matcher matcher(sequence, inputs.store, inputs.moving);
    const Surfaces surfaces(inputs, matcher.imagery_budget_bytes());
    const std::string source = capture::labels_source(sequence);
    const auto& cameras = sequence.info().cameras;
    const auto num_frames = static_cast<int>(sequence.frames().size());
    LabelFiles files;
    core::Progress progress(inputs.context, "images",
                            num_frames * static_cast<std::int64_t>(cameras.size()));
    for (int frame = 0; frame < num_frames; ++frame)
      for (int camera = 0; camera < static_cast<int>(cameras.size()); ++camera) {
        core::throw_if_stop_asked();
        const capture::CameraCalibration& calibration = cameras[static_cast<std::size_t>(camera)];
        const fs::path name =
            fs::path(calibration.rig) / calibration.name / fmt::format("{:06}.exr", frame);
        const fs::path file = sequence.folder() / capture::kLabelsFolder / "albedo" / name;
        files.insert(name);
        if (!is_label_image_done(file, source, calibration.intrinsics, "albedo", "albedo.R"))
          write(albedo_of(matcher, surfaces, {frame, camera}), file, source,
                calibration.intrinsics);
        progress.advance();
      }
    return files;
  }

 private:
  using Planes = std::array<std::vector<float>, 3>;

  static Planes albedo_of(const Matcher& matcher, const Surfaces& surfaces, const ImageOf& image) {
    const geo::CameraModel& model = matcher.model(image.camera);
    const BlockedPixels all = blocked_pixels(model.width_px(), model.height_px());
    const Recast cast = matcher.recast(image, all.pixels, world::SurfaceNeed::Look);
    std::vector<scene::Color> albedo(cast.rays.size());
    core::parallel_for(static_cast<std::int64_t>(all.begins.size()) - 1, [&](std::int64_t block) {
      const auto at = static_cast<std::size_t>(block);
      const auto ray_from = [&](std::size_t pixel) {
        return static_cast<std::size_t>(
            std::lower_bound(cast.of_pixel.begin(), cast.of_pixel.end(), pixel) -
            cast.of_pixel.begin());
      };
      const std::size_t first = ray_from(all.begins[at]);
      const std::size_t count = ray_from(all.begins[at + 1]) - first;
      if (count == 0) return;
      const Eigen::Vector2i& corner = all.pixels[all.begins[at]];
      const Eigen::Vector2i& last = all.pixels[all.begins[at + 1] - 1];
      const auto rays = std::span(cast.rays).subspan(first, count);
      const auto hits = std::span(cast.hits).subspan(first, count);
      const auto met = std::span(cast.surfaces).subspan(first, count);
      const std::vector<double> sea_m = sea_depths_m(matcher.whole(), rays, hits, met);
      scene::SurfaceLooks::Scratch scratch;
      surfaces.looks.find_albedo(
          {.rays = rays,
           .hits = hits,
           .surfaces = met,
           .sun_share = {},
           .sky_share = {},
           .sample_width =
               scene::sample_width(model, 0.5 * (corner + last).cast<double>().array() + 0.5, 1.0),
           .sea_depth_m = sea_m},
          surfaces.up, scratch, std::span(albedo).subspan(first, count));
    });
    Planes planes;
    planes.fill(std::vector<float>(all.pixels.size(), std::numeric_limits<float>::quiet_NaN()));
    for (std::size_t k = 0; k < albedo.size(); ++k) {
      const Eigen::Vector2i& pixel = all.pixels[cast.of_pixel[k]];
      for (std::size_t c = 0; c < 3; ++c)
        planes[c][static_cast<std::size_t>(pixel.y() * model.width_px() + pixel.x())] =
            albedo[k][static_cast<int>(c)];
    }
    return planes;
  }

  static void write(const Planes& planes, const fs::path& file, const std::string& source,
                    const geo::CameraIntrinsics& image) {
    using Type = core::ExrChannel::Type;
    write_label_image(file, source, image, "albedo",
                      {{.name = "albedo.B", .type = Type::Float, .values_float = planes[2]},
                       {.name = "albedo.G", .type = Type::Float, .values_float = planes[1]},
                       {.name = "albedo.R", .type = Type::Float, .values_float = planes[0]}});
  }
};

}  // namespace

LabelInfo albedo_label() {
  return {.name = "albedo",
          .summary = "Colour of every pixel's surface, whatever the light.",
          .make = []() -> std::unique_ptr<LabelMaker> { return std::make_unique<AlbedoLabel>(); }};
}

}  // namespace terracast::labels
