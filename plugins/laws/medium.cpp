#include <cmath>
#include <limits>

#include "core/parallel.h"
#include "core/random.h"
#include "plugins/laws/laws.h"

namespace terracast::plugins {
namespace {

using Eigen::Vector3d;

constexpr std::uint64_t kSeed = 7;
constexpr std::int64_t kNumRays = 400;
/// Integrals along a ray are cut into steps: a longer ray may seem clearer by this share.
constexpr double kStepShare = 1e-3;

class MediumLaws {
 public:
  MediumLaws(const scene::Medium& medium, const LawScene& world, LawReport& report)
      : medium_(medium), frame_(world.scene.frame()), report_(report) {
    const Vector3d middle = world.body.at(0.0).world_from_body.translation;
    for (std::int64_t i = 0; i < kNumRays; ++i) rays_.push_back(ray_about(middle, i));
  }

  void try_all() {
    suns_share_is_a_share();
    transmittance_is_a_share();
    light_is_finite_and_not_negative();
    distance_lies_on_the_ray();
    farther_is_no_clearer();
    the_same_ray_has_the_same_light();
  }

 private:
  struct Ray {
    Vector3d origin, direction;
    double until_m, jitter;
  };

  /// Places up to 3 km about the body, rays all around; a tenth of them ends nowhere.
  static Ray ray_about(const Vector3d& middle, std::int64_t i) {
    const auto index = static_cast<std::uint64_t>(i);
    const auto draw = [&](double low, double high, std::uint64_t stream) {
      return core::random_between(low, high, kSeed, stream, index);
    };
    Ray ray;
    ray.origin = middle + Vector3d(draw(-3e3, 3e3, 1), draw(-3e3, 3e3, 2), draw(-200.0, 3e3, 3));
    const double z = draw(-1.0, 1.0, 4);
    const double turn = draw(0.0, 6.283185307179586, 5);
    const double level = std::sqrt(1.0 - z * z);
    ray.direction = {level * std::cos(turn), level * std::sin(turn), z};
    ray.direction.normalize();
    ray.until_m = i % 10 == 0 ? std::numeric_limits<double>::infinity()
                              : std::exp(draw(0.0, std::log(5e4), 6));
    ray.jitter = draw(0.0, 1.0, 7);
    return ray;
  }

  scene::SeenMedium look(const Ray& ray) const {
    const scene::SampleWidth width;
    return medium_.look(
        {.origin_world = ray.origin,
         .direction_world = ray.direction,
         .until_m = ray.until_m,
         .from_height_m = static_cast<float>(frame_.geodetic_from_world(ray.origin).height_m),
         .sample_width = width,
         .jitter = ray.jitter});
  }

  std::string place_of(const Ray& ray) const {
    return fmt::format(
        "from ({:.1f}, {:.1f}, {:.1f}) along ({:.3f}, {:.3f}, {:.3f}) until {:.4g} m",
        ray.origin.x(), ray.origin.y(), ray.origin.z(), ray.direction.x(), ray.direction.y(),
        ray.direction.z(), ray.until_m);
  }

  template <class Judge>
  void of_all_rays(Judge judge) {
    for (const Ray& ray : rays_) {
      if (!report_.holds()) return;
      judge(ray, look(ray));
    }
  }

  void suns_share_is_a_share() {
    report_.begin("the sun's light comes through in a share from 0 to 1");
    for (const Ray& ray : rays_) {
      const double share = medium_.sun_transmittance(ray.origin);
      report_.expect(share >= 0.0 && share <= 1.0,
                     fmt::format("{} at the place of the ray {}", share, place_of(ray)));
    }
  }

  void transmittance_is_a_share() {
    report_.begin("light from behind comes through in shares from 0 to 1");
    of_all_rays([&](const Ray& ray, const scene::SeenMedium& seen) {
      for (const auto share : seen.transmittance)
        report_.expect(share >= 0 && share <= 1, fmt::format("{} {}", share, place_of(ray)));
    });
  }

  void light_is_finite_and_not_negative() {
    report_.begin("light that is added is finite and not negative");
    of_all_rays([&](const Ray& ray, const scene::SeenMedium& seen) {
      for (const auto light : seen.radiance)
        report_.expect(std::isfinite(light) && light >= 0,
                       fmt::format("{} {}", light, place_of(ray)));
    });
  }

  void distance_lies_on_the_ray() {
    report_.begin("light is scattered between the viewer and the surface");
    of_all_rays([&](const Ray& ray, const scene::SeenMedium& seen) {
      report_.expect(seen.distance_m >= 0.0 && seen.distance_m <= ray.until_m &&
                         std::isfinite(seen.distance_m),
                     fmt::format("at {} m {}", seen.distance_m, place_of(ray)));
    });
  }

  void farther_is_no_clearer() {
    report_.begin("what is farther is seen no clearer");
    of_all_rays([&](const Ray& ray, const scene::SeenMedium& seen) {
      Ray nearer = ray;
      nearer.until_m = std::isfinite(ray.until_m) ? 0.5 * ray.until_m : 1e3;
      const scene::SeenMedium before = look(nearer);
      for (int k = 0; k < seen.transmittance.size(); ++k)
        report_.expect(static_cast<double>(seen.transmittance[k]) <=
                           static_cast<double>(before.transmittance[k]) + kStepShare,
                       fmt::format("{} {}, and {} until {:.4g} m", seen.transmittance[k],
                                   place_of(ray), before.transmittance[k], nearer.until_m));
    });
  }

  void the_same_ray_has_the_same_light() {
    report_.begin("the same ray has the same light, from any thread");
    std::vector<scene::SeenMedium> beside(rays_.size());
    const core::ThreadLimit limit(4);
    core::parallel_for(kNumRays, [&](std::int64_t i) {
      beside[static_cast<std::size_t>(i)] = look(rays_[static_cast<std::size_t>(i)]);
    });
    std::size_t at = 0;
    of_all_rays([&](const Ray& ray, const scene::SeenMedium& seen) {
      const scene::SeenMedium& other = beside[at++];
      report_.expect((seen.transmittance == other.transmittance).all() &&
                         (seen.radiance == other.radiance).all() &&
                         seen.distance_m == other.distance_m,
                     place_of(ray));
    });
  }

  const scene::Medium& medium_;
  const geo::WorldFrame& frame_;
  LawReport& report_;
  std::vector<Ray> rays_;
};

}  // namespace

void try_medium(const core::Choice<scene::MediumInfo>& medium, const LawScene& world,
                LawReport& report) {
  report.begin("it is made of its options");
  const auto made =
      core::made(medium->make({.store = world.scene.store(),
                               .sky = world.scene.sky(),
                               .sea_level_m = world.scene.ground().climate().sea_level_m}),
                 "medium", medium.kind());
  MediumLaws(*made, world, report).try_all();
}

}  // namespace terracast::plugins
