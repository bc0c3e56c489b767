#include "coupler/base/hdf5_file.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "coupler/base/errors.hpp"

namespace ocublast {
namespace {

class Hdf5FileTest : public ::testing::Test {
 protected:
  std::filesystem::path file_ = std::filesystem::temp_directory_path() /
                                ("ocublast_hdf5_" + std::to_string(getpid()) + ".h5");
  void TearDown() override { std::filesystem::remove(file_); }
};

TEST_F(Hdf5FileTest, GivesBackWhatWasWritten) {
  const std::vector<double> values{1.0, 2.5, -3.0, 4.0, 5.0, 6.0};
  const std::vector<std::string> names{"sclera", "cornea"};
  auto out = Hdf5File::create(file_);
  out.write("nodes", values, {2, 3}, "m");
  out.write("cells/hex8", std::vector<std::int32_t>{1, 2, 3}, {3}, "1");
  out.write_text("tissues", names);
  out.write_attribute("format", std::string("ocublast-mesh"));
  out.write_attribute("version", std::int64_t{1});
  out.close();
  const auto in = Hdf5File::open(file_);
  std::vector<std::size_t> shape;
  EXPECT_EQ(in.read<double>("nodes", &shape), values);
  EXPECT_EQ(shape, (std::vector<std::size_t>{2, 3}));
  EXPECT_EQ(in.read_text("tissues"), names);
  EXPECT_EQ(in.text_attribute("format"), "ocublast-mesh");
  EXPECT_EQ(in.integer_attribute("version"), 1);
  EXPECT_EQ(in.list("cells"), std::vector<std::string>{"hex8"});
  EXPECT_TRUE(in.has("cells/hex8"));
  EXPECT_FALSE(in.has("cells/tet4"));
}

TEST_F(Hdf5FileTest, NamesFileAndDatasetThatAreMissing) {
  auto out = Hdf5File::create(file_);
  out.close();
  const auto in = Hdf5File::open(file_);
  try {
    static_cast<void>(in.read<double>("nodes"));
    FAIL() << "reading a missing dataset must throw";
  } catch (const LinkError& error) {
    EXPECT_NE(std::string(error.what()).find("nodes"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find(file_.string()), std::string::npos);
  }
}

}  // namespace
}  // namespace ocublast
