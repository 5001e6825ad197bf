#include "app/export/hdf5_file.h"

#include <hdf5.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>

#include "core/error.h"

namespace knuckle::exporting {
namespace {

constexpr std::size_t kChunkRows = 1024;
constexpr unsigned kFastDeflate = 1;

hid_t native(NumberType type) {
  switch (type) {
    case NumberType::kUint8:
      return H5T_NATIVE_UINT8;
    case NumberType::kUint16:
      return H5T_NATIVE_UINT16;
    case NumberType::kUint32:
      return H5T_NATIVE_UINT32;
    case NumberType::kUint64:
      return H5T_NATIVE_UINT64;
    case NumberType::kInt64:
      return H5T_NATIVE_INT64;
    case NumberType::kFloat:
      return H5T_NATIVE_FLOAT;
    case NumberType::kDouble:
      break;
  }
  return H5T_NATIVE_DOUBLE;
}

/// Something of HDF5's that is closed at the end of its scope.
class Owned {
 public:
  Owned(hid_t handle, herr_t (*close)(hid_t)) : handle_(handle), close_(close) {}
  ~Owned() {
    if (handle_ >= 0) close_(handle_);
  }
  Owned(const Owned&) = delete;
  Owned& operator=(const Owned&) = delete;
  operator hid_t() const noexcept { return handle_; }

 private:
  hid_t handle_;
  herr_t (*close_)(hid_t);
};

std::size_t longest(const std::vector<std::string>& texts) {
  std::size_t bytes = 1;
  for (const std::string& text : texts) bytes = std::max(bytes, text.size());
  return bytes;
}

/// One behind the other, each filled up with zeros.
std::string evened(const std::vector<std::string>& texts) {
  const std::size_t bytes = longest(texts);
  std::string all;
  for (std::string text : texts) {
    text.resize(bytes);
    all += text;
  }
  return all;
}

/// Of strings of this many bytes, which need no zero at the end. Nominally ASCII, whatever is in them: Octave reads no
/// others.
hid_t text_type(std::size_t bytes) {
  const hid_t type = H5Tcopy(H5T_C_S1);
  H5Tset_size(type, bytes);
  H5Tset_strpad(type, H5T_STR_NULLPAD);
  return type;
}

hid_t row_of(hsize_t count) {
  return H5Screate_simple(1, &count, nullptr);
}

}  // namespace

template <typename Result>
Result Hdf5File::done(Result result) const {
  if (result < 0) place_.fail(errno != 0 ? errno : EIO);
  return result;
}

Hdf5File::Hdf5File(cli::OutputFile& place) : place_(place) {
  struct stat about {};
  if (fstat(place.descriptor(), &about) != 0) place.fail(errno);
  if (!S_ISREG(about.st_mode))
    throw InputError(place.refusal(ENOTSUP) + ": HDF5 is not written in one stream, name a file");
  H5dont_atexit();  // else it tries again at the program's end to write what the disk has refused, and crashes
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // failures are ours to tell
  // The file that is put in place at the end has no name of its own to the outside.
  const std::string path = "/proc/self/fd/" + std::to_string(place.descriptor());
  errno = 0;
  file_ = done(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT));
  making_groups_ = done(H5Pcreate(H5P_LINK_CREATE));
  done(H5Pset_create_intermediate_group(making_groups_, 1));
}

Hdf5File::~Hdf5File() {
  for (const Dataset& dataset : datasets_) H5Dclose(dataset.handle);
  if (making_groups_ >= 0) H5Pclose(making_groups_);
  if (file_ >= 0) H5Fclose(file_);
}

std::size_t Hdf5File::add_dataset(const std::string& path, NumberType type, std::size_t width) {
  const int rank = width > 1 ? 2 : 1;
  const std::array<hsize_t, 2> none{0, width}, most{H5S_UNLIMITED, width}, chunk{kChunkRows, width};
  const Owned space(done(H5Screate_simple(rank, none.data(), most.data())), H5Sclose);
  const Owned how(done(H5Pcreate(H5P_DATASET_CREATE)), H5Pclose);
  done(H5Pset_chunk(how, rank, chunk.data()));
  done(H5Pset_shuffle(how));
  done(H5Pset_deflate(how, kFastDeflate));
  Dataset dataset;
  dataset.handle = done(H5Dcreate2(file_, path.c_str(), native(type), space, making_groups_, how, H5P_DEFAULT));
  dataset.type = type;
  dataset.width = width;
  dataset.row_bytes = width * H5Tget_size(native(type));
  datasets_.push_back(std::move(dataset));
  return datasets_.size() - 1;
}

void Hdf5File::add_row(std::size_t dataset, const void* row) {
  Dataset& to = datasets_.at(dataset);
  const auto* const bytes = static_cast<const std::uint8_t*>(row);
  to.waiting.insert(to.waiting.end(), bytes, bytes + to.row_bytes);
  if (to.waiting.size() == kChunkRows * to.row_bytes) write_waiting(to);
}

void Hdf5File::write_waiting(Dataset& dataset) {
  const std::uint64_t rows = dataset.waiting.size() / dataset.row_bytes;
  if (rows == 0) return;
  const int rank = dataset.width > 1 ? 2 : 1;
  const std::array<hsize_t, 2> all{dataset.rows + rows, dataset.width}, begin{dataset.rows, 0},
      count{rows, dataset.width};
  errno = 0;
  done(H5Dset_extent(dataset.handle, all.data()));
  const Owned in_file(done(H5Dget_space(dataset.handle)), H5Sclose);
  const Owned in_memory(done(H5Screate_simple(rank, count.data(), nullptr)), H5Sclose);
  done(H5Sselect_hyperslab(in_file, H5S_SELECT_SET, begin.data(), nullptr, count.data(), nullptr));
  done(H5Dwrite(dataset.handle, native(dataset.type), in_memory, in_file, H5P_DEFAULT, dataset.waiting.data()));
  dataset.rows += rows;
  dataset.waiting.clear();
}

void Hdf5File::put_texts(const std::string& path, const std::vector<std::string>& texts, Handle space) {
  const Owned type(done(text_type(longest(texts))), H5Tclose);
  const Owned set(done(H5Dcreate2(file_, path.c_str(), type, space, making_groups_, H5P_DEFAULT, H5P_DEFAULT)),
                  H5Dclose);
  if (!texts.empty()) done(H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, evened(texts).data()));
}

void Hdf5File::add_texts(const std::string& path, const std::vector<std::string>& texts) {
  put_texts(path, texts, Owned(done(row_of(texts.size())), H5Sclose));
}

void Hdf5File::add_text(const std::string& path, const std::string& text) {
  put_texts(path, {text}, Owned(done(H5Screate(H5S_SCALAR)), H5Sclose));
}

void Hdf5File::put_attribute(const std::string& path, const std::string& name, Handle type, Handle space,
                             const void* value) {
  const Owned attribute(
      done(H5Acreate_by_name(file_, path.c_str(), name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT)),
      H5Aclose);
  done(H5Awrite(attribute, type, value));
}

void Hdf5File::attribute(const std::string& path, const std::string& name, const std::string& text) {
  const Owned type(done(text_type(longest({text}))), H5Tclose), space(done(H5Screate(H5S_SCALAR)), H5Sclose);
  put_attribute(path, name, type, space, evened({text}).data());
}

void Hdf5File::attribute(const std::string& path, const std::string& name, const std::vector<std::string>& texts) {
  const Owned type(done(text_type(longest(texts))), H5Tclose), space(done(row_of(texts.size())), H5Sclose);
  put_attribute(path, name, type, space, evened(texts).data());
}

void Hdf5File::close() {
  for (Dataset& dataset : datasets_) {
    write_waiting(dataset);
    done(H5Dclose(std::exchange(dataset.handle, -1)));
  }
  datasets_.clear();
  errno = 0;
  done(H5Pclose(std::exchange(making_groups_, -1)));
  done(H5Fclose(std::exchange(file_, -1)));
}

}  // namespace knuckle::exporting
