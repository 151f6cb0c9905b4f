#pragma once

#include <Eigen/Core>
#include <vector>

namespace terracast::geo {

/// A way on the map made of straight lines and arcs of circles, by its length.
class GroundTrack {
 public:
  /// ahead   unit vector
  GroundTrack(const Eigen::Vector2d& start, const Eigen::Vector2d& ahead)
      : position_(start), ahead_(ahead) {}

  void go_straight(double length_m) { add(length_m, 0.0); }
  /// angle_rad   positive: to the left
  void turn(double angle_rad, double radius_m);
  /// Turns back to the opposite direction, onto the line that lies `left_m` to the left (negative: to
  /// the right) and beside the place where the turn begins. Lines that are nearer than two radii are
  /// reached by swinging out first.
  void turn_back(double left_m, double radius_m);

  /// Goes to a place and direction the shortest way that turns, goes straight and turns again.
  void go_to(const Eigen::Vector2d& place, const Eigen::Vector2d& ahead, double radius_m);

  double length_m() const { return length_m_; }
  Eigen::Vector2d at(double length_m) const;

 private:
  struct Piece {
    double begin_m, length_m;
    Eigen::Vector2d start, ahead;
    double curvature;  ///< positive: to the left
    Eigen::Vector2d at(double length_m) const;
  };
  void add(double length_m, double curvature);

  std::vector<Piece> pieces_;
  Eigen::Vector2d position_, ahead_;
  double length_m_ = 0.0;
};

}  // namespace terracast::geo
