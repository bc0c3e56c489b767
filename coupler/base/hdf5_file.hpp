#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace ocublast {

/// An HDF5 file, created or opened whole, closed by the destructor or by `close`, which is checked.
/// Throws LinkError with file and dataset names. Datasets are written row-major with a `units`
/// attribute. Paths may hold groups ("tissue/hex8"); missing groups are created.
class Hdf5File {
 public:
  [[nodiscard]] static Hdf5File create(const std::filesystem::path& file);
  [[nodiscard]] static Hdf5File open(const std::filesystem::path& file);
  ~Hdf5File();
  Hdf5File(Hdf5File&& other) noexcept
      : file_(std::move(other.file_)), id_(std::exchange(other.id_, -1)) {}
  Hdf5File& operator=(Hdf5File&& other) noexcept;
  Hdf5File(const Hdf5File&) = delete;
  Hdf5File& operator=(const Hdf5File&) = delete;
  /// Flushes and closes; throws LinkError when data could not be written (disk full).
  void close();

  template <class T>  // double, float, std::int32_t, std::int64_t, std::uint8_t
  void write(const std::string& name, std::span<const T> values, std::vector<std::size_t> shape,
             const std::string& units);
  template <class T>
  void write(const std::string& name, const std::vector<T>& values, std::vector<std::size_t> shape,
             const std::string& units) {
    write(name, std::span<const T>(values), std::move(shape), units);
  }
  void write_text(const std::string& name, std::span<const std::string> values);

  /// The dataset converted to T, with its shape.
  template <class T>
  [[nodiscard]] std::vector<T> read(const std::string& name,
                                    std::vector<std::size_t>* shape = nullptr) const;
  [[nodiscard]] std::vector<std::string> read_text(const std::string& name) const;
  [[nodiscard]] bool has(const std::string& name) const;
  /// Names in a group, in alphabetical order; empty where there is no such group.
  [[nodiscard]] std::vector<std::string> list(const std::string& group) const;

  void write_attribute(const std::string& name, const std::string& value);
  void write_attribute(const std::string& name, std::int64_t value);
  [[nodiscard]] std::string text_attribute(const std::string& name) const;
  [[nodiscard]] std::int64_t integer_attribute(const std::string& name) const;

 private:
  Hdf5File(std::filesystem::path file, std::int64_t id) : file_(std::move(file)), id_(id) {}
  std::filesystem::path file_;
  std::int64_t id_ = -1;  ///< hid_t; -1 when closed
};

/// Writes `text` aside and renames it over `file`, so that a reader never sees half of it.
void replace_file(const std::filesystem::path& file, const std::string& text);

}  // namespace ocublast
