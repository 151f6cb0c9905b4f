#include <gdal_priv.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "core/error.h"
#include "tests/support/expect_error.h"
#include "tiler/apart/form_io.h"
#include "tiler/apart/raster_form.h"

// What a process says of a raster is believed only as far as it holds together.
namespace terracast::test {
namespace {

using core::ErrorKind;

tiler::RasterForm small_form() {
  tiler::RasterForm form;
  form.format = "AAIGrid";
  form.width = 5;
  form.height = 3;
  form.planes = {{.type = GDT_Float32, .block_width = 5, .block_height = 1, .unread = {}}};
  form.bands.resize(1);
  return form;
}

TEST(RasterForm, ThatDoesNotHoldTogetherIsRefused) {
  constexpr std::uint64_t kBytes = 60;
  tiler::check_raster_form(small_form(), kBytes, "grid");
  const std::function<void(tiler::RasterForm&)> wrongs[] = {
      [](auto& form) { form.width = 0; },
      [](auto& form) { form.height = -3; },
      [](auto& form) { form.width = 6; },
      [](auto& form) { form.height = 2000000000; },
      [](auto& form) { form.bands.clear(); },
      [](auto& form) { form.bands.resize(2); },
      [](auto& form) { form.planes.clear(); },
      [](auto& form) { form.planes[0].type = GDT_Unknown; },
      [](auto& form) { form.planes[0].type = GDT_Float64; },
      [](auto& form) { form.planes[0].block_width = 0; },
      [](auto& form) { form.planes[0].block_height = -1; },
      [](auto& form) { form.planes[0].block_height = 2000000000; },
      [](auto& form) { form.planes[0].unread = {{.first = 3, .count = 1, .why = ""}}; },
      [](auto& form) { form.planes[0].unread = {{.first = -1, .count = 1, .why = ""}}; },
      [](auto& form) { form.planes[0].unread = {{.first = 0, .count = 4, .why = ""}}; },
      [](auto& form) { form.bands[0].mask_plane = 0; },
      [](auto& form) { form.bands[0].mask_plane = 1; },
      [](auto& form) { form.bands[0].num_overviews = -1; },
      [](auto& form) {
        form.bands[0].colours = {{{1, 2, 3, 255}}};
      },
  };
  int index = 0;
  for (const auto& wrong : wrongs) {
    SCOPED_TRACE(index++);
    tiler::RasterForm form = small_form();
    wrong(form);
    expect_error(ErrorKind::Input, {"grid", "damaged"},
                 [&] { tiler::check_raster_form(form, kBytes, "grid"); });
  }
  for (const std::uint64_t bytes : {0, 59, 61})
    expect_error(ErrorKind::Input, {"grid", "damaged"},
                 [&] { tiler::check_raster_form(small_form(), bytes, "grid"); });
}

TEST(RasterForm, CutOrLengthenedIsRefused) {
  tiler::RasterForm form = small_form();
  form.metadata = {{.domain = "notes", .items = {"a=1", "b=2"}}};
  form.bands[0].categories = {"water", "rock"};
  form.bands[0].no_data = -9999.0;
  const std::vector<std::byte> right = tiler::encode_form(form);
  EXPECT_EQ(tiler::encode_form(tiler::decode_form<tiler::RasterForm>(right, "grid")), right);
  for (std::size_t size = 0; size < right.size(); ++size)
    expect_error(ErrorKind::Input, {"grid", "damaged"}, [&] {
      tiler::decode_form<tiler::RasterForm>(std::span(right).first(size), "grid");
    });
  std::vector<std::byte> longer = right;
  longer.push_back(std::byte{0});
  expect_error(ErrorKind::Input, {"grid", "damaged"},
               [&] { tiler::decode_form<tiler::RasterForm>(longer, "grid"); });
  // Any four bytes may be a count.
  for (std::size_t at = 0; at + 4 <= right.size(); ++at) {
    std::vector<std::byte> wrong = right;
    std::fill_n(wrong.begin() + static_cast<std::ptrdiff_t>(at), 4, std::byte{0x7f});
    try {
      tiler::check_raster_form(tiler::decode_form<tiler::RasterForm>(wrong, "grid"), 60, "grid");
    } catch (const core::Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::Input);
    }
  }
}

}  // namespace
}  // namespace terracast::test
