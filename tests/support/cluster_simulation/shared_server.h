#pragma once

#include <cmath>
#include <optional>
#include <set>
#include <utility>
#include <vector>

namespace terracast::test {

/// Gives n clients who ask at once an n-th each of what it can do, and to none more than its own limit.
/// Those who wait for work are clients too, but as a crowd: each sleeps, asks, and sleeps again.
class SharedServer {
 public:
  SharedServer(double units_per_s, double client_units_per_s);

  bool is_instant() const { return std::isinf(units_per_s_) && std::isinf(client_units_per_s_); }

  void advance(double now_s);
  void add(int client, double units, std::vector<double>& end_of_client);
  void remove(int client, const std::vector<double>& end_of_client);
  /// Who is served next, and when.
  std::optional<std::pair<double, int>> next() const;
  /// taken_per_s   by renewals
  /// num_waiting   who ask for so many units each, after a pause
  void set_crowd(double taken_per_s, double num_waiting, double units, double pause_s);
  /// Between two times that one who waits begins to ask.
  double period_s() const { return pause_s_ + waiting_units_ / rate_; }
  /// All that those who wait have asked for.
  double crowd_units() const { return crowd_units_; }

 private:
  void update();

  double units_per_s_;
  double client_units_per_s_;
  double taken_per_s_ = 0.0;
  double num_waiting_ = 0.0;
  double waiting_units_ = 0.0;
  double pause_s_ = 0.0;
  double crowd_units_ = 0.0;
  double now_s_ = 0.0;
  double served_ = 0.0;  ///< units that a client who was there all the time has had
  double rate_ = 1.0;
  std::set<std::pair<double, int>> clients_;  ///< by the value of served_ at which they are through
};

}  // namespace terracast::test
