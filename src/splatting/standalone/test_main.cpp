// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

int main(int argc, char** argv) { return tiny_test::run_all(argc, argv); }
