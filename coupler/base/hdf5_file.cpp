#include "coupler/base/hdf5_file.hpp"

#include <fmt/format.h>
#include <hdf5.h>

#include <algorithm>
#include <fstream>
#include <type_traits>

#include "coupler/base/errors.hpp"

namespace ocublast {
namespace {

/// A raw HDF5 handle with the function that closes it.
class Handle {
 public:
  Handle(hid_t id, herr_t (*close)(hid_t), const std::string& what) : id_(id), close_(close) {
    if (id_ < 0) throw LinkError(what);
  }
  ~Handle() { close_(id_); }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  [[nodiscard]] hid_t get() const { return id_; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

template <class T>
hid_t native_type() {
  if constexpr (std::is_same_v<T, double>) return H5T_NATIVE_DOUBLE;
  if constexpr (std::is_same_v<T, float>) return H5T_NATIVE_FLOAT;
  if constexpr (std::is_same_v<T, std::int32_t>) return H5T_NATIVE_INT32;
  if constexpr (std::is_same_v<T, std::int64_t>) return H5T_NATIVE_INT64;
  if constexpr (std::is_same_v<T, std::uint8_t>) return H5T_NATIVE_UINT8;
}

void silence_hdf5() {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}  // errors become exceptions

void write_text_attribute(hid_t object, const std::string& name, const std::string& value) {
  Handle type(H5Tcopy(H5T_C_S1), H5Tclose, "HDF5 string type");
  H5Tset_size(type.get(), std::max<std::size_t>(1, value.size()));
  H5Tset_cset(type.get(), H5T_CSET_UTF8);
  Handle space(H5Screate(H5S_SCALAR), H5Sclose, "HDF5 space");
  if (H5Aexists(object, name.c_str()) > 0) H5Adelete(object, name.c_str());
  Handle attribute(
      H5Acreate2(object, name.c_str(), type.get(), space.get(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose,
      "cannot write HDF5 attribute " + name);
  H5Awrite(attribute.get(), type.get(), value.empty() ? " " : value.c_str());
}

Handle make_dataset(hid_t file, const std::string& name, hid_t type, hid_t space,
                    const std::filesystem::path& path) {
  Handle link(H5Pcreate(H5P_LINK_CREATE), H5Pclose, "HDF5 property list");
  H5Pset_create_intermediate_group(link.get(), 1);
  return Handle(H5Dcreate2(file, name.c_str(), type, space, link.get(), H5P_DEFAULT, H5P_DEFAULT),
                H5Dclose, fmt::format("{}: cannot create dataset {}", path.string(), name));
}

}  // namespace

Hdf5File Hdf5File::create(const std::filesystem::path& file) {
  silence_hdf5();
  if (file.has_parent_path()) std::filesystem::create_directories(file.parent_path());
  const hid_t id = H5Fcreate(file.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  if (id < 0) throw LinkError(fmt::format("{}: cannot create this HDF5 file", file.string()));
  return {file, id};
}

Hdf5File Hdf5File::open(const std::filesystem::path& file) {
  silence_hdf5();
  const hid_t id = H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  if (id < 0) throw LinkError(fmt::format("{}: not a readable HDF5 file", file.string()));
  return {file, id};
}

Hdf5File::~Hdf5File() {
  if (id_ >= 0) H5Fclose(id_);
}

Hdf5File& Hdf5File::operator=(Hdf5File&& other) noexcept {
  std::swap(file_, other.file_);
  std::swap(id_, other.id_);
  return *this;
}

void Hdf5File::close() {
  const bool flushed = H5Fflush(id_, H5F_SCOPE_GLOBAL) >= 0;
  const bool closed = H5Fclose(std::exchange(id_, -1)) >= 0;
  if (!flushed || !closed)
    throw LinkError(
        fmt::format("{}: could not be written to the end; is the disk full?", file_.string()));
}

template <class T>
void Hdf5File::write(const std::string& name, std::span<const T> values,
                     std::vector<std::size_t> shape, const std::string& units) {
  std::vector<hsize_t> extents(shape.begin(), shape.end());
  Handle space(H5Screate_simple(static_cast<int>(extents.size()), extents.data(), nullptr),
               H5Sclose, fmt::format("{}: bad shape for {}", file_.string(), name));
  OCU_ASSERT(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space.get())) == values.size());
  const Handle dataset = make_dataset(id_, name, native_type<T>(), space.get(), file_);
  if (!values.empty() &&
      H5Dwrite(dataset.get(), native_type<T>(), H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0)
    throw LinkError(fmt::format("{}: cannot write {}; is the disk full?", file_.string(), name));
  write_text_attribute(dataset.get(), "units", units);
}

template <class T>
std::vector<T> Hdf5File::read(const std::string& name, std::vector<std::size_t>* shape) const {
  Handle dataset(H5Dopen2(id_, name.c_str(), H5P_DEFAULT), H5Dclose,
                 fmt::format("{}: no dataset {}", file_.string(), name));
  Handle space(H5Dget_space(dataset.get()), H5Sclose, "HDF5 space");
  std::vector<hsize_t> extents(static_cast<std::size_t>(H5Sget_simple_extent_ndims(space.get())));
  H5Sget_simple_extent_dims(space.get(), extents.data(), nullptr);
  if (shape != nullptr) shape->assign(extents.begin(), extents.end());
  std::vector<T> values(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space.get())));
  if (!values.empty() &&
      H5Dread(dataset.get(), native_type<T>(), H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0)
    throw LinkError(fmt::format("{}: dataset {} cannot be read as numbers", file_.string(), name));
  return values;
}

template void Hdf5File::write(const std::string&, std::span<const double>, std::vector<std::size_t>,
                              const std::string&);
template void Hdf5File::write(const std::string&, std::span<const float>, std::vector<std::size_t>,
                              const std::string&);
template void Hdf5File::write(const std::string&, std::span<const std::int32_t>,
                              std::vector<std::size_t>, const std::string&);
template void Hdf5File::write(const std::string&, std::span<const std::int64_t>,
                              std::vector<std::size_t>, const std::string&);
template void Hdf5File::write(const std::string&, std::span<const std::uint8_t>,
                              std::vector<std::size_t>, const std::string&);
template std::vector<double> Hdf5File::read(const std::string&, std::vector<std::size_t>*) const;
template std::vector<float> Hdf5File::read(const std::string&, std::vector<std::size_t>*) const;
template std::vector<std::int32_t> Hdf5File::read(const std::string&,
                                                  std::vector<std::size_t>*) const;
template std::vector<std::int64_t> Hdf5File::read(const std::string&,
                                                  std::vector<std::size_t>*) const;
template std::vector<std::uint8_t> Hdf5File::read(const std::string&,
                                                  std::vector<std::size_t>*) const;

void Hdf5File::write_text(const std::string& name, std::span<const std::string> values) {
  std::size_t width = 1;
  for (const auto& value : values) width = std::max(width, value.size());
  std::vector<char> packed(width * values.size(), '\0');
  for (std::size_t i = 0; i < values.size(); ++i)
    std::copy(values[i].begin(), values[i].end(), packed.begin() + static_cast<long>(i * width));
  Handle type(H5Tcopy(H5T_C_S1), H5Tclose, "HDF5 string type");
  H5Tset_size(type.get(), width);
  H5Tset_strpad(type.get(), H5T_STR_NULLPAD);
  const hsize_t n = values.size();
  Handle space(H5Screate_simple(1, &n, nullptr), H5Sclose, "HDF5 space");
  const Handle dataset = make_dataset(id_, name, type.get(), space.get(), file_);
  if (n > 0 &&
      H5Dwrite(dataset.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, packed.data()) < 0)
    throw LinkError(fmt::format("{}: cannot write {}", file_.string(), name));
}

std::vector<std::string> Hdf5File::read_text(const std::string& name) const {
  Handle dataset(H5Dopen2(id_, name.c_str(), H5P_DEFAULT), H5Dclose,
                 fmt::format("{}: no dataset {}", file_.string(), name));
  Handle stored(H5Dget_type(dataset.get()), H5Tclose, "HDF5 type");
  if (H5Tget_class(stored.get()) != H5T_STRING || H5Tis_variable_str(stored.get()) > 0)
    throw LinkError(
        fmt::format("{}: {} is not a list of fixed-length texts", file_.string(), name));
  Handle space(H5Dget_space(dataset.get()), H5Sclose, "HDF5 space");
  const auto n = static_cast<std::size_t>(H5Sget_simple_extent_npoints(space.get()));
  const std::size_t width = H5Tget_size(stored.get());
  std::vector<char> packed(width * n);
  if (n > 0 &&
      H5Dread(dataset.get(), stored.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, packed.data()) < 0)
    throw LinkError(fmt::format("{}: {} cannot be read", file_.string(), name));
  std::vector<std::string> values;
  for (std::size_t i = 0; i < n; ++i) {
    std::string value(packed.data() + i * width, width);
    value.resize(std::min(value.find('\0'), value.size()));
    values.push_back(std::move(value));
  }
  return values;
}

bool Hdf5File::has(const std::string& name) const {
  std::string prefix;
  std::size_t begin = 0;
  while (begin <= name.size()) {  // HDF5 wants every part of a path checked in turn
    const auto slash = std::min(name.find('/', begin), name.size());
    prefix = name.substr(0, slash);
    if (!prefix.empty() && H5Lexists(id_, prefix.c_str(), H5P_DEFAULT) <= 0) return false;
    begin = slash + 1;
  }
  return true;
}

std::vector<std::string> Hdf5File::list(const std::string& group) const {
  std::vector<std::string> names;
  if (!has(group)) return names;
  Handle handle(H5Gopen2(id_, group.c_str(), H5P_DEFAULT), H5Gclose,
                fmt::format("{}: {} is no group", file_.string(), group));
  const auto add = [](hid_t, const char* name, const H5L_info_t*, void* out) -> herr_t {
    static_cast<std::vector<std::string>*>(out)->emplace_back(name);
    return 0;
  };
  H5Literate(handle.get(), H5_INDEX_NAME, H5_ITER_INC, nullptr, add, &names);
  return names;
}

void Hdf5File::write_attribute(const std::string& name, const std::string& value) {
  write_text_attribute(id_, name, value);
}

void Hdf5File::write_attribute(const std::string& name, std::int64_t value) {
  Handle space(H5Screate(H5S_SCALAR), H5Sclose, "HDF5 space");
  Handle attribute(
      H5Acreate2(id_, name.c_str(), H5T_NATIVE_INT64, space.get(), H5P_DEFAULT, H5P_DEFAULT),
      H5Aclose, "cannot write HDF5 attribute " + name);
  H5Awrite(attribute.get(), H5T_NATIVE_INT64, &value);
}

std::string Hdf5File::text_attribute(const std::string& name) const {
  Handle attribute(H5Aopen(id_, name.c_str(), H5P_DEFAULT), H5Aclose,
                   fmt::format("{}: no attribute {}", file_.string(), name));
  Handle type(H5Aget_type(attribute.get()), H5Tclose, "HDF5 type");
  if (H5Tget_class(type.get()) != H5T_STRING)
    throw LinkError(fmt::format("{}: attribute {} is no text", file_.string(), name));
  if (H5Tis_variable_str(type.get()) > 0) {  // as h5py writes them
    char* text = nullptr;
    H5Aread(attribute.get(), type.get(), &text);
    std::string value = text != nullptr ? text : "";
    H5free_memory(text);
    return value;
  }
  std::string value(H5Tget_size(type.get()), '\0');
  H5Aread(attribute.get(), type.get(), value.data());
  value.resize(std::min(value.find('\0'), value.size()));
  return value;
}

std::int64_t Hdf5File::integer_attribute(const std::string& name) const {
  Handle attribute(H5Aopen(id_, name.c_str(), H5P_DEFAULT), H5Aclose,
                   fmt::format("{}: no attribute {}", file_.string(), name));
  std::int64_t value = 0;
  if (H5Aread(attribute.get(), H5T_NATIVE_INT64, &value) < 0)
    throw LinkError(fmt::format("{}: attribute {} is no number", file_.string(), name));
  return value;
}

void replace_file(const std::filesystem::path& file, const std::string& text) {
  auto aside = file;
  aside += ".part";
  {
    std::ofstream out(aside, std::ios::binary | std::ios::trunc);
    out << text;
    out.close();
    if (!out)
      throw LinkError(fmt::format("{}: cannot be written; is the disk full?", file.string()));
  }
  std::filesystem::rename(aside, file);
}

}  // namespace ocublast
