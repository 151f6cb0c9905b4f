#include "tests/support/cluster_simulation/shared_server.h"

#include <algorithm>
#include <cmath>

#include "tests/support/cluster_simulation/index.h"

namespace terracast::test {

SharedServer::SharedServer(double units_per_s, double client_units_per_s)
    : units_per_s_(units_per_s), client_units_per_s_(client_units_per_s) {
  update();
}

void SharedServer::advance(double now_s) {
  if (!clients_.empty()) served_ += (now_s - now_s_) * rate_;
  if (num_waiting_ > 0.0)
    crowd_units_ += (now_s - now_s_) * num_waiting_ * waiting_units_ / period_s();
  now_s_ = now_s;
}

void SharedServer::add(int client, double units, std::vector<double>& end_of_client) {
  end_of_client[at(client)] = served_ + units;
  clients_.emplace(served_ + units, client);
  update();
}

void SharedServer::remove(int client, const std::vector<double>& end_of_client) {
  clients_.erase({end_of_client[at(client)], client});
  update();
}

std::optional<std::pair<double, int>> SharedServer::next() const {
  if (clients_.empty()) return std::nullopt;
  const auto& [end, client] = *clients_.begin();
  return std::pair(now_s_ + std::max(0.0, end - served_) / rate_, client);
}

void SharedServer::set_crowd(double taken_per_s, double num_waiting, double units, double pause_s) {
  taken_per_s_ = taken_per_s;
  num_waiting_ = num_waiting;
  waiting_units_ = units;
  pause_s_ = pause_s;
  update();
}

void SharedServer::update() {
  // rate (n + w u / (p rate + u)) = R, where u / (p rate + u) is the part of the time in which one
  // who waits is asking.
  const double n = static_cast<double>(clients_.size());
  const double left = std::max(units_per_s_ - taken_per_s_, 1e-3 * units_per_s_);
  if (std::isinf(units_per_s_)) {
    rate_ = client_units_per_s_;
    return;
  }
  double rate = left / std::max(n, 1.0);
  if (num_waiting_ > 0.0 && waiting_units_ > 0.0) {
    const double a = pause_s_ * n;
    const double b = (n + num_waiting_) * waiting_units_ - pause_s_ * left;
    const double c = -left * waiting_units_;
    if (a > 0.0)
      rate = b > 0.0 ? 2.0 * -c / (b + std::sqrt(b * b - 4.0 * a * c))
                     : (-b + std::sqrt(b * b - 4.0 * a * c)) / (2.0 * a);
    else
      rate = b > 0.0 ? -c / b : left;
  }
  rate_ = std::min(client_units_per_s_, rate);
}

}  // namespace terracast::test
