#include "tests/e2e/chaos_faults.h"

#include <map>

namespace terracast::test {

std::string fault_name(Fault fault) {
  static const std::map<Fault, std::string> kNames = {
      {Fault::Kill, "killed"},
      {Fault::Stop, "stopped past the lease"},
      {Fault::StopAndKill, "stopped past the lease and killed"},
      {Fault::FullDisk, "full disk"},
      {Fault::ReadOnly, "read-only disk"},
      {Fault::DamageAtRest, "damaged at rest"},
      {Fault::DamageAtWork, "damaged at work"},
      {Fault::ClockAhead, "clock two days ahead"},
      {Fault::ClocksDiffer, "clocks that differ"},
      {Fault::ClockJump, "clock jump"}};
  return kNames.at(fault);
}

bool is_of_disk(Fault fault) { return fault == Fault::FullDisk || fault == Fault::ReadOnly; }
bool is_of_clock(Fault fault) {
  return fault == Fault::ClockAhead || fault == Fault::ClocksDiffer || fault == Fault::ClockJump;
}

}  // namespace terracast::test
