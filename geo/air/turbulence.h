#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

/// Turbulence of MIL-F-8785C along a straight line: frozen in the air, of unit variance, by the distance in lengths of
/// its scale. A speed is its strength (sigma) times this.
namespace terracast::geo {

enum class TurbulenceModel { Dryden, VonKarman };
/// Along the line (u of the standard), or across it (v and w).
enum class TurbulenceComponent { Along, Across };

/// Covariance of two places that lie so far apart: 1 at distance 0.
/// lengths    0 or more
/// accuracy   1e-13
/// source     MIL-F-8785C (1980), section 3.7.1, whose spectra it is the transform of:
///              Dryden       along (2/pi) / (1 + w^2), across (1/pi) (1 + 3 w^2) / (1 + w^2)^2
///              von Karman   along (2/pi) / (1 + (a w)^2)^(5/6), across (1/pi) (1 + 8/3 (a w)^2) / (1 + (a w)^2)^(11/6)
///            with a = 1.339 and w in radians a length. (That a is rounded: the variance of the printed spectra is 1 - 1.1e-5.) MIL-HDBK-1797 halves the length of the components across and
///            writes 2 L for it: the same.
double turbulence_covariance(TurbulenceModel model, TurbulenceComponent component, double lengths);

/// Dryden's filter of white noise at places that are evenly spaced: x(k+1) = transition x(k) + noise, y = output' x.
/// All covariances are those of the continuous filter at the places, without approximation.
struct ShapingFilter {
  /// Of one state or two, without memory of its own.
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 2, 2>;
  using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 2, 1>;

  Matrix transition;  ///< exp(A step)
  Matrix noise;       ///< covariance of what a step adds
  Matrix stationary;  ///< covariance of x
  Vector output;
};
ShapingFilter dryden_filter(TurbulenceComponent component, double step_lengths);

/// A drawn line of turbulence. Threads: safe.
class UnitTurbulence {
 public:
  /// Nodes stand so far apart: what is shorter than two of them is not there.
  static constexpr double kSpacing = 1.0 / 256.0;
  static constexpr double kMostLengths = 16000.0;

  /// end_lengths   up to kMostLengths
  /// seed, stream  of its random numbers alone. Dryden's line is the same for any end; von Karman's for ends
  ///               whose numbers of nodes have the same next power of two.
  /// accuracy      at the nodes its covariance is turbulence_covariance(), without approximation: Dryden by its filter from a
  ///               stationary start, von Karman by embedding the covariance in a circulant matrix. Between nodes, through which
  ///               a curve goes that is three times continuously differentiable, the variance is lower by up to 0.1 % (Dryden), 0.5 % (von Karman).
  /// cost          50 ns (Dryden), 300 ns (von Karman) a node; 8 bytes a node, of von Karman up to 100 while it is drawn
  /// throws        Input: a longer one
  /// source        Dietrich and Newsam, Fast and exact simulation of stationary Gaussian processes (SIAM J. Sci. Comput. 1997)
  UnitTurbulence(TurbulenceModel model, TurbulenceComponent component, double end_lengths,
                 std::uint64_t seed, std::uint64_t stream);

  /// lengths   0 to end_lengths()
  double at(double lengths) const;
  double end_lengths() const { return end_lengths_; }
  /// Values at multiples of the spacing from -kBeyond spacings on, of which the first ones and last ones help to interpolate.
  const std::vector<double>& nodes() const { return nodes_; }
  static constexpr std::size_t kBeyond = 3;

 private:
  double end_lengths_;
  std::vector<double> nodes_;
};

}  // namespace terracast::geo
