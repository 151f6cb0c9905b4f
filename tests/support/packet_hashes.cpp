// Prints the hashes of frame_hashes.h. Its packet code is built for one instruction set alone, baseline x86-64
// (TERRACAST_BASELINE_PACKETS) or AVX2 (avx2_packets.h), for tests/sensors/packet_code_test.cpp to compare.
//
//     terracast_baseline_packets FOLDER      which is made
//     terracast_avx2_packets FOLDER

#include <cstdio>
#include <exception>

#include "tests/support/frame_hashes.h"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  try {
    std::fputs(terracast::test::frame_hashes(argv[1]).c_str(), stdout);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
