// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/html/markup.h"

#include <gtest/gtest.h>

namespace photoslam::html {
namespace {

TEST(Markup, Base64AsInRfc4648) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(base64("\xfb\xff\xfe"), "+//+");
}

TEST(Markup, EscapesWhatHasAMeaning) { EXPECT_EQ(escape("a<b> & \"c\" ü"), "a&lt;b&gt; &amp; &quot;c&quot; ü"); }

}  // namespace
}  // namespace photoslam::html
