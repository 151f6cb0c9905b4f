#include <gtest/gtest.h>

#include "tests/tiler/model_files.h"

/// OBJ and its libraries of materials as the format's text has them and programs write them. Colours are worked out by hand
/// with sRGB's transfer function (IEC 61966-2-1).
namespace terracast::test {
namespace {

using core::ErrorKind;
using Eigen::Vector2f;
using Eigen::Vector3d;
using tiler::Model;

class Obj : public testing::Test {
 protected:
  Model read(const std::string& text) {
    write_text(folder_ / "model.obj", text);
    return read_as_it_is(folder_ / "model.obj");
  }
  Model read(const std::string& text, const std::string& library) {
    write_text(folder_ / "model.mtl", library);
    return read("mtllib model.mtl\n" + text);
  }
  void refuses(const std::string& text, const std::vector<std::string>& words) {
    SCOPED_TRACE(text);
    expect_error(ErrorKind::Input, words, [&] { read(text); });
  }
  const ScratchFolder folder_;
  const std::string square_ =
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl a\n"
      "f 1/1 2/2 3/3 4/4\n";
};

// Until 2026-11 "tex\halves.png" was no path, though it lay there.
TEST_F(Obj, BackslashesPartFoldersInLibrariesAndPictures) {
  std::filesystem::create_directories(folder_ / "lib" / "tex");
  write_halves(folder_ / "lib" / "tex" / "halves.png");
  for (const char* picture : {"tex\\halves.png", "tex/halves.png", ".\\tex\\halves.png",
                              "..\\lib\\tex\\halves.png", "lib\\tex\\halves.png"}) {
    write_text(folder_ / "lib" / "a.mtl", fmt::format("newmtl a\r\nmap_Kd {}\r\n", picture));
    for (const char* library : {"lib\\a.mtl", "lib/a.mtl", ".\\lib\\a.mtl"}) {
      const Model model = read(fmt::format("mtllib {}\r\n", library) + square_);
      EXPECT_EQ(model.textures.size(), 1U) << picture << " of " << library;
      EXPECT_EQ(count_in(model, "textures missing"), 0) << picture << " of " << library;
    }
  }
}

TEST_F(Obj, PathsOfAnotherDiskAreLookedForBesideTheModel) {
  write_halves(folder_ / "halves.png");
  for (const char* path : {"C:\\Users\\me\\halves.png", "D:/work/halves.png",
                           "/elsewhere/halves.png", "\\\\server\\share\\halves.png"})
    EXPECT_EQ(read(square_, fmt::format("newmtl a\nmap_Kd {}\n", path)).textures.size(), 1U)
        << path;
  write_text(folder_ / "model.mtl", "newmtl a\nmap_Kd C:\\Users\\me\\gone.png\n");
  refuses("mtllib model.mtl\n" + square_, {"C:\\Users\\me\\gone.png", "beside the model"});
}

TEST_F(Obj, NamesWithBlanksOptionsAndQuotesAreRead) {
  write_halves(folder_ / "two halves (1).png");
  for (const char* text : {"map_Kd two halves (1).png", "map_kd  two halves (1).png  ",
                           "map_Kd -s 1 1 1 -o 0 0 0 two halves (1).png",
                           "map_Kd -blendu on -texres 512 -mm 0 1 -bm 1 two halves (1).png",
                           "map_Kd \"two halves (1).png\""})
    EXPECT_EQ(read(square_, fmt::format("newmtl a\n{}\n", text)).textures.size(), 1U) << text;
  write_text(folder_ / "my own.mtl", "newmtl a\nKd 1 0 0\n");
  EXPECT_EQ(color(read("mtllib my own.mtl\n" + square_)), (Codes{255, 0, 0}));
  write_text(folder_ / "b.mtl", "newmtl b\nKd 0 1 0\n");
  write_text(folder_ / "a.mtl", "newmtl a\nKd 0 0 1\n");
  EXPECT_EQ(color(read("mtllib b.mtl a.mtl\n" + square_)), (Codes{0, 0, 255}));
}

TEST_F(Obj, OptionsOfPicturesScaleAndMoveThem) {
  write_halves(folder_ / "halves.png");
  const auto far_corner = [&](const std::string& options) {
    return uv(finest(read(square_, "newmtl a\nmap_Kd " + options + " halves.png\n")), 0, 2);
  };
  EXPECT_EQ(far_corner(""), Vector2f(1, 1));
  EXPECT_EQ(far_corner("-s 2 3"), Vector2f(2, 3));
  EXPECT_EQ(far_corner("-s 2 3 1 -o 0.25 0.5 0"), Vector2f(2.25, 3.5));
  EXPECT_EQ(far_corner("-o 0.5"), Vector2f(1.5, 1));
  const Model clamped = read(square_, "newmtl a\nmap_Kd -clamp on -s 2 2 halves.png\n");
  EXPECT_EQ(count_in(clamped, "triangles beyond a picture's edge, where it repeats all the same"),
            2);
}

TEST_F(Obj, ColoursAreWhatAScreenShowsAndMultiplyInLinearLight) {
  write_halves(folder_ / "halves.png");
  EXPECT_EQ(color(read(square_, "newmtl a\nKd 0.5 1 0.25\n")), (Codes{128, 255, 64}));
  EXPECT_EQ(color(read(square_, "newmtl a\nKd 0.5\n")), (Codes{128, 128, 128})) << "a grey";
  EXPECT_EQ(color(read(square_, "newmtl a\nKd 0.5 1 0.25 # a comment\n")), (Codes{128, 255, 64}));
  // The picture is multiplied by Kd; where that is 0 the picture is meant.
  EXPECT_EQ(color(read(square_, "newmtl a\nKd 0.5 1 1\nmap_Kd halves.png\n")),
            (Codes{128, 255, 255}));
  EXPECT_EQ(color(read(square_, "newmtl a\nmap_Kd halves.png\n")), (Codes{255, 255, 255}));
  const Model black = read(square_, "newmtl a\nKd 0 0 0\nmap_Kd halves.png\n");
  EXPECT_EQ(color(black), (Codes{255, 255, 255}));
  EXPECT_EQ(count_in(black, "materials of Kd 0 0 0, shown by their picture alone"), 1);
  // Of a picture that is not there Kd is left.
  const Model gone = read(square_, "newmtl a\nKd 0.5 1 1\nmap_Kd gone.png\n");
  EXPECT_EQ(color(gone), (Codes{128, 255, 255}));
  EXPECT_EQ(count_in(gone, "textures missing"), 1);
  EXPECT_EQ(entry(gone, "texture").not_understood.count("gone.png is not there"), 1U);
}

TEST_F(Obj, ColoursOfVerticesStandBehindTheirPlaces) {
  const auto colored = [](const std::string& color) {
    return "v 0 0 0 " + color + "\nv 1 0 0 " + color + "\nv 1 1 0 " + color +
           "\nusemtl a\nf 1 2 3\n";
  };
  EXPECT_EQ(color(read(colored("0.5 0.25 1"))), (Codes{128, 64, 255}));
  EXPECT_EQ(color(read(colored("1.0 0.5 0.25 1"))), (Codes{128, 64, 255})) << "behind a weight";
  // 0.5 of Kd x 0.5: 0.214041^2 = 0.045814, which is sRGB 0.23679.
  EXPECT_EQ(color(read(colored("0.5 0.25 1"), "newmtl a\nKd 0.5 1 1\n")), (Codes{60, 64, 255}));
  // Corners of 1, 0 and 0: a third, sRGB 0.6124.
  EXPECT_EQ(color(read("v 0 0 0 1 0 0\nv 1 0 0 0 0 0\nv 1 1 0 0 0 0\nf 1 2 3\n")),
            (Codes{156, 0, 0}));
  // A surface with a picture shows that.
  write_halves(folder_ / "halves.png");
  EXPECT_EQ(
      color(read("v 0 0 0 0 1 0\nv 1 0 0 0 1 0\nv 1 1 0 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\n",
                 "newmtl a\nmap_Kd halves.png\n")),
      (Codes{255, 255, 255}));
  EXPECT_EQ(entry(read(colored("200 100 50")), "OBJ v").num_not_understood(), 3);
}

TEST_F(Obj, NumbersOfCornersCountFromTheBeginningOrBack) {
  const Model forward =
      read("v 0 0 0\nv 2 0 0\nv 0 2 0\nf 1 2 3\nv 0 0 9\nv 2 0 9\nv 0 2 9\nf 4 5 6\n");
  const Model back =
      read("v 0 0 0\nv 2 0 0\nv 0 2 0\nf -3 -2 -1\nv 0 0 9\nv 2 0 9\nv 0 2 9\nf -3 -2 -1\n");
  EXPECT_EQ(finest(forward), finest(back));
  EXPECT_EQ(corner(finest(back), 1, 2), Vector3d(0, 2, 9));
  // A face may stand before its vertices.
  EXPECT_EQ(finest(read("f 1 2 3\nv 0 0 0\nv 2 0 0\nv 0 2 0\n")).triangles.size(), 1U);
  const std::string places = "v 0 0 0\nv 2 0 0\nv 0 2 0\n";
  refuses(places + "f 1 2 4\n", {"line 4", "vertex 4 of 3"});
  refuses(places + "f 1 2 -4\n", {"line 4", "\"-4\"", "beyond the first of 3"});
  refuses(places + "f 0 1 2\n", {"line 4", "\"0\"", "begin with 1"});
  // Places on pictures that are not there are told, and the surface is shown.
  const Model without = read(places + "f 1/1 2/1 3/1\n");
  EXPECT_EQ(entry(without, "OBJ f").not_understood.at("a vt beyond the last of 0"), 3);
  refuses(std::string("\xff\xfev\0 \0", 6), {"UTF-16", "UTF-8"});
  refuses(std::string("\xfe\xff\0v\0 ", 6), {"UTF-16", "UTF-8"});
  refuses(places + "f 1 2 x\n", {"line 4", "\"x\""});
  refuses(places + "f 1 2 99999999999999999999\n", {"line 4"});
  refuses("v 0 0\nf 1 1 1\n", {"line 1", "v has 2 numbers"});
  refuses("v 0 0 zero\nf 1 1 1\n", {"line 1", "\"zero\""});
}

TEST_F(Obj, FacesOfAnyShapeKeepTheirAreaAndTurn) {
  // An L of area 3, from each of its corners on, and the other way round.
  const std::string places = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\n";
  for (int first = 0; first < 6; ++first)
    for (const int step : {1, 5}) {
      std::string face = "f";
      for (int k = 0; k < 6; ++k) face += fmt::format(" {}", (first + step * k) % 6 + 1);
      const Model model = read(places + face + "\n");
      double sum = 0.0;
      for (std::size_t i = 0; i < finest(model).triangles.size(); ++i) {
        const double own = doubled_area(finest(model), i).z();
        EXPECT_GT(step == 1 ? own : -own, 0.0) << face;
        sum += std::abs(own);
      }
      EXPECT_EQ(sum, 6.0) << face;
    }
}

TEST_F(Obj, StatementsGoOnBehindBackslashesAndEndAtComments) {
  const Model model = read(
      "\xef\xbb\xbf# a mark of UTF-8\nv 0 0 0\nv 2 0 \\\n 0\nv 2 2 0 # here\n  v\t0 2 0\nf 1 2 "
      "\\\r\n3 \\\n4\n");
  EXPECT_EQ(finest(model).triangles.size(), 2U);
  EXPECT_EQ(corner(finest(model), 1, 2), Vector3d(0, 2, 0));
}

TEST_F(Obj, WhatHasNoSurfaceOrIsNotReadIsCounted) {
  const Model model = read(
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\nf 1 2\nl 1 2 3\np 1\ncstype bezier\ndeg 3 3\nsurf 0 1 0 "
      "1 1 2 3\nend\nglow 7\n");
  EXPECT_EQ(count_in(model, "faces that are no triangles"), 3);
  EXPECT_EQ(count_in(model, "curved surfaces and curves (curv, surf) left out"), 1);
  EXPECT_EQ(entry(model, "OBJ cstype").num_ignored, 1);
  EXPECT_EQ(entry(model, "OBJ glow").num_unknown, 1);
}

TEST_F(Obj, LibrariesAndMaterialsThatAreNotThereAreToldByName) {
  const Model missing = read("mtllib gone.mtl\n" + square_);
  EXPECT_EQ(count_in(missing, "libraries of materials missing"), 1);
  EXPECT_EQ(entry(missing, "OBJ mtllib").not_understood.count("gone.mtl is not there"), 1U);
  EXPECT_EQ(entry(missing, "OBJ usemtl").not_understood.count("a is in no library"), 1U);
  EXPECT_EQ(color(missing), (Codes{153, 153, 153}));
  // A pair that was renamed.
  write_text(folder_ / "model.mtl", "newmtl a\nKd 1 0 0\n");
  const Model renamed = read("mtllib gone.mtl\n" + square_);
  EXPECT_EQ(color(renamed), (Codes{255, 0, 0}));
  EXPECT_EQ(count_in(renamed, "libraries of the model's own name, read for missing ones"), 1);
}

TEST_F(Obj, MaterialsThatLetLightThroughAreCounted) {
  const auto count = [&](const std::string& text) {
    return count_in(read(square_, "newmtl a\nKd 1 0 0\n" + text),
                    "materials that let light through, shown opaque");
  };
  EXPECT_EQ(count(""), 0);
  EXPECT_EQ(count("d 1\n"), 0);
  EXPECT_EQ(count("d 0.5\n"), 1);
  EXPECT_EQ(count("d -halo 0.5\n"), 1);
  EXPECT_EQ(count("Tr 0\n"), 0);
  EXPECT_EQ(count("Tr 0.5\n"), 1);
  // Some programs write one for the other: d decides.
  EXPECT_EQ(count("d 1\nTr 1\n"), 0);
  EXPECT_EQ(count("Tr 1\nd 1\n"), 0);
}

TEST_F(Obj, ColoursBeyondWhatAShapeHasAreMergedToTheNearestAndCounted) {
  // 1024 shades of red and green, 32 x 32.
  std::string text = "v 0 0 0\nv 1 0 0\nv 1 1 0\n", library;
  for (int i = 0; i < 1024; ++i) {
    library += fmt::format("newmtl m{}\nKd {} {} 0\n", i, (i % 32) / 31.0, (i / 32) / 31.0);
    text += fmt::format("usemtl m{}\nf 1 2 3\n", i);
  }
  const Model model = read(text, library);
  EXPECT_LE(finest(model).finishes.size(), 256U);
  EXPECT_GT(count_in(model, "colours merged"), 0);
  // The finest grid of powers of 2 with at most 256 cells of 8 bits has cells of 16: half of one off.
  for (std::size_t i = 0; i < 1024; ++i) {
    EXPECT_NEAR(color(model, i)[0], 255.0 * static_cast<double>(i % 32) / 31.0, 8.5) << i;
    EXPECT_NEAR(color(model, i)[1], 255.0 * static_cast<double>(i / 32) / 31.0, 8.5) << i;
  }
}

}  // namespace
}  // namespace terracast::test
