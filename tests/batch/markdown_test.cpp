#include "batch/dataset/markdown.h"

#include <gtest/gtest.h>

namespace terracast::batch {
namespace {

// What MD4C, with all of GitHub's extensions, shows as the text itself in a paragraph, a heading, a
// list and a cell; random texts were held against it when this was written.
TEST(Markdown, ShowsTextAsItIs) {
  EXPECT_EQ(markdown_text("Flights through valleys"), "Flights through valleys");
  EXPECT_EQ(markdown_text("lcam_front"), "lcam_front");
  EXPECT_EQ(markdown_text("_lcam_"), "\\_lcam\\_");
  EXPECT_EQ(markdown_text("a | b"), "a \\| b");
  EXPECT_EQ(markdown_text("back\\slash"), "back\\\\slash");
  EXPECT_EQ(markdown_text("<script>alert(1)</script>"), "\\<script\\>alert(1)\\</script\\>");
  EXPECT_EQ(markdown_text("![x](http://evil)"), "\\!\\[x\\](http\\://evil)");
  EXPECT_EQ(markdown_text("www.evil.org"), "www\\.evil.org");
  EXPECT_EQ(markdown_text("me@evil.org"), "me\\@evil.org");
  EXPECT_EQ(markdown_text("# heading"), "\\# heading");
  EXPECT_EQ(markdown_text("- item"), "\\- item");
  EXPECT_EQ(markdown_text("1. item"), "1\\. item");
  EXPECT_EQ(markdown_text("0.1.0"), "0.1.0");
  EXPECT_EQ(markdown_text("a - b = c"), "a - b = c");
  EXPECT_EQ(markdown_text("---"), "\\---");
  EXPECT_EQ(markdown_text("`code` **bold** ~~gone~~ &amp;"),
            "\\`code\\` \\*\\*bold\\*\\* \\~\\~gone\\~\\~ \\&amp;");
  EXPECT_EQ(markdown_text("  blanks  "), "blanks");
  EXPECT_EQ(markdown_text("Grüße"), "Grüße");
}

TEST(Markdown, KeepsTextOnOneLine) {
  EXPECT_EQ(markdown_text("one\ntwo\r\n| three"), "one\\\\x0atwo\\\\x0d\\\\x0a\\| three");
  EXPECT_EQ(markdown_text("no\xffutf8"), "no\\\\xffutf8");
}

TEST(Markdown, OfSeveralLinesKeepsThem) {
  EXPECT_EQ(markdown_lines("one\n\n# two"), "one\n\n\\# two\n");
  EXPECT_EQ(markdown_lines(""), "");
  EXPECT_EQ(markdown_code("@misc{x,\n}\t"), "    @misc{x,\n    }\\x09\n");
}

TEST(Markdown, TablesHaveARowALine) {
  EXPECT_EQ(markdown_table({"name", "count"}, {{"a", "1"}, {"b", "22"}}, {false, true}),
            "| name | count |\n| --- | ---: |\n| a | 1 |\n| b | 22 |\n");
}

}  // namespace
}  // namespace terracast::batch
