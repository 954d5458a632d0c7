#include "host/particles/formats/hdf5_library.h"

#ifdef MOTE_HAS_HDF5

#include <fmt/format.h>
#include <hdf5.h>
#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <optional>
#include <utility>

#include "host/core/error.h"
#include "host/particles/formats/input_file.h"
#include "host/particles/formats/section.h"

namespace mote {
namespace {

constexpr std::size_t kMostNames = 4096, kMostNumbers = 64, kMostText = 1024;
constexpr hsize_t kMostArity = 1 << 16;
constexpr std::size_t kBlockBytes = 1 << 22;  ///< of rows at once where the file has smaller chunks, or none
/// No writer of particles comes near (SWIFT: 2^20 rows); libhdf5's own limit is 4 GiB.
constexpr std::uint64_t kMostChunkBytes = std::uint64_t{1} << 30;
/// N-bit and scale-offset keep one bit of 64 at least, szip one block of 32 pixels in some bits.
constexpr std::uint64_t kOtherExpansion = 64;

/// Quiet, and without links into other files: what has to be said once in a process.
void prepare() {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  if (H5Lis_registered(H5L_TYPE_EXTERNAL) > 0) H5Lunregister(H5L_TYPE_EXTERNAL);
}

/// What an identifier stands for is closed with it.
class Handle {
 public:
  explicit Handle(hid_t id = -1) : id_(id) {}
  ~Handle() {
    if (id_ >= 0) H5Idec_ref(id_);
  }
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)) {}
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;

  operator hid_t() const { return id_; }
  bool ok() const { return id_ >= 0; }

 private:
  hid_t id_;
};

/// The first cause of what has just failed.
std::string reason() {
  std::string text;
  H5Ewalk2(
      H5E_DEFAULT, H5E_WALK_UPWARD,
      [](unsigned, const H5E_error2_t* error, void* to) {
        auto& first = *static_cast<std::string*>(to);
        if (first.empty() && error->desc) first = error->desc;
        return herr_t{0};
      },
      &text);
  return text.empty() ? "damaged data" : text;
}

hid_t memoryType(NumberType type) {
  switch (type) {
    case NumberType::I8: return H5T_NATIVE_INT8;
    case NumberType::I16: return H5T_NATIVE_INT16;
    case NumberType::I32: return H5T_NATIVE_INT32;
    case NumberType::I64: return H5T_NATIVE_INT64;
    case NumberType::U8: return H5T_NATIVE_UINT8;
    case NumberType::U16: return H5T_NATIVE_UINT16;
    case NumberType::U32: return H5T_NATIVE_UINT32;
    case NumberType::U64: return H5T_NATIVE_UINT64;
    case NumberType::F64: return H5T_NATIVE_DOUBLE;
    case NumberType::F16:
    case NumberType::F32: break;
  }
  return H5T_NATIVE_FLOAT;
}

std::optional<NumberType> numberType(hid_t type) {
  const std::size_t size = H5Tget_size(type);  // 0 in damaged files
  if (size < 1 || size > 8) return std::nullopt;
  switch (H5Tget_class(type)) {
    case H5T_FLOAT: return size > 4 ? NumberType::F64 : NumberType::F32;
    case H5T_INTEGER: break;
    default: return std::nullopt;
  }
  const bool sign = H5Tget_sign(type) != H5T_SGN_NONE;
  switch (size) {
    case 1: return sign ? NumberType::I8 : NumberType::U8;
    case 2: return sign ? NumberType::I16 : NumberType::U16;
    case 4: return sign ? NumberType::I32 : NumberType::U32;
    case 8: return sign ? NumberType::I64 : NumberType::U64;
    default: return std::nullopt;
  }
}

/// Names in a group, in their order.
std::vector<std::string> namesIn(hid_t group) {
  std::vector<std::string> names;
  H5Literate(
      group, H5_INDEX_NAME, H5_ITER_INC, nullptr,
      [](hid_t, const char* name, const H5L_info_t* info, void* to) {
        auto& all = *static_cast<std::vector<std::string>*>(to);
        if (info->type == H5L_TYPE_HARD || info->type == H5L_TYPE_SOFT) all.emplace_back(name);
        return herr_t{all.size() < kMostNames ? 0 : 1};
      },
      &names);
  return names;
}

/// How a dataset's numbers lie in the file.
struct Layout {
  H5D_layout_t kind = H5D_LAYOUT_ERROR;
  std::uint64_t stored = 0;         ///< bytes in the file
  std::uint64_t expansion = 1;      ///< what one of them may become
  hsize_t chunk[2] = {1, 1};        ///< rows and columns
  std::uint64_t chunkBytes = 0;     ///< …
  std::vector<H5Z_filter_t> steps;  ///< filters, in the order of writing
  bool ownPath = false;             ///< shuffled and deflated, as nearly all are: undone here
  bool external = false;
};

Layout layoutOf(hid_t dataset, std::size_t numberBytes) {
  Layout layout;
  const Handle plist(H5Dget_create_plist(dataset));
  if (!plist.ok()) return layout;
  layout.kind = H5Pget_layout(plist);
  layout.external = H5Pget_external_count(plist) > 0;
  if (layout.kind == H5D_VIRTUAL || layout.external) return layout;
  layout.stored = H5Dget_storage_size(dataset);
  if (layout.kind != H5D_CHUNKED) return layout;
  if (H5Pget_chunk(plist, 2, layout.chunk) < 0) layout.kind = H5D_LAYOUT_ERROR;
  layout.chunk[0] = std::max<hsize_t>(layout.chunk[0], 1), layout.chunk[1] = std::max<hsize_t>(layout.chunk[1], 1);
  layout.chunkBytes = layout.chunk[0] * layout.chunk[1] * numberBytes;  // each below 2^32, as is the product (libhdf5)
  const int filters = H5Pget_nfilters(plist);
  bool known = true, deflated = false;
  for (int k = 0; k < filters; ++k) {
    unsigned flags = 0, config = 0;
    std::size_t values = 0;
    const H5Z_filter_t filter =
        H5Pget_filter2(plist, static_cast<unsigned>(k), &flags, &values, nullptr, 0, nullptr, &config);
    layout.steps.push_back(filter);
    deflated = deflated || filter == H5Z_FILTER_DEFLATE;
    known = known && (filter == H5Z_FILTER_DEFLATE || filter == H5Z_FILTER_SHUFFLE || filter == H5Z_FILTER_FLETCHER32);
  }
  if (deflated) layout.expansion = kDeflateExpansion;
  if (!known) layout.expansion = kDeflateExpansion * kOtherExpansion;
  layout.ownPath = known && deflated;
  return layout;
}

/// Whether the bytes that are stored can be so many numbers.
bool canHold(const Layout& layout, std::uint64_t fileBytes, std::uint64_t bytes) {
  return layout.stored <= fileBytes && bytes / layout.expansion <= layout.stored &&
         (layout.kind != H5D_CHUNKED || (layout.chunkBytes <= kMostChunkBytes &&
                                         (bytes == 0 || layout.chunkBytes / layout.expansion <= layout.stored)));
}

/// A filter's name for people.
std::string filterName(H5Z_filter_t filter) {
  switch (filter) {
    case 32000: return "LZF";
    case 32001: return "Blosc";
    case 32004: return "LZ4";
    case 32015: return "Zstandard";
    default: return fmt::format("number {}", filter);
  }
}

}  // namespace

struct Hdf5Library::Impl {
  std::string path;
  std::uint64_t bytes = 0;
  Handle file;

  static hid_t open(const std::string& path) {
    prepare();
    const Handle access(H5Pcreate(H5P_FILE_ACCESS));
    H5Pset_file_locking(access, false, true);  // read-only shares may not lock
    const hid_t id = H5Fopen(path.c_str(), H5F_ACC_RDONLY, access);
    if (id < 0) throw InputError(path, "HDF5", "a file that libhdf5 opens", reason(), "the file is cut off or damaged");
    return id;
  }
  explicit Impl(const std::string& name) : path(name), bytes(InputFile(name).bytes()), file(open(name)) {}

  [[noreturn]] void fail(const std::string& what, const std::string& expected, const std::string& got,
                         const char* hint = "the file is damaged") const {
    throw InputError(path, what, expected, got, hint);
  }
  std::vector<Hdf5Array> arrays(hid_t group) const;
  std::vector<Metadata> attributes(hid_t group) const;
};

namespace {

/// The shape of a dataset as rows and columns; none: it has another number of dimensions.
std::optional<std::pair<hsize_t, hsize_t>> shapeOf(hid_t dataset) {
  const Handle space(H5Dget_space(dataset));
  if (!space.ok() || H5Sget_simple_extent_type(space) != H5S_SIMPLE) return std::nullopt;
  const int rank = H5Sget_simple_extent_ndims(space);
  hsize_t size[2] = {0, 1};
  if (rank < 1 || rank > 2 || H5Sget_simple_extent_dims(space, size, nullptr) < 0) return std::nullopt;
  return std::pair(size[0], size[1]);
}

std::vector<std::string> otherFiles(hid_t dataset) {
  const Handle plist(H5Dget_create_plist(dataset));
  std::vector<std::string> files;
  std::size_t count = 0;
  H5Pget_virtual_count(plist, &count);
  for (std::size_t k = 0; k < std::min(count, kMostNames); ++k) {
    char name[kMostText] = {};
    if (H5Pget_virtual_filename(plist, k, name, sizeof name) < 0) break;
    if (files.empty() || files.back() != name) files.emplace_back(name);
  }
  return files;
}

std::optional<Hdf5Array> arrayOf(hid_t dataset, std::string name, std::uint64_t fileBytes) {
  const auto shape = shapeOf(dataset);
  const Handle type(H5Dget_type(dataset));
  if (!shape || !type.ok()) return std::nullopt;
  const auto number = numberType(type);
  if (!number || shape->second == 0 || shape->second > kMostArity) return std::nullopt;
  Hdf5Array array{std::move(name), *number, shape->first, static_cast<std::uint32_t>(shape->second), false, {}};
  const std::size_t size = H5Tget_size(type), row = size * array.arity;
  const Layout layout = layoutOf(dataset, size);
  if (layout.kind == H5D_VIRTUAL) array.otherFiles = otherFiles(dataset);
  if (layout.kind == H5D_COMPACT || layout.kind == H5D_CONTIGUOUS || layout.kind == H5D_CHUNKED)
    array.stored = !layout.external && array.rows <= std::numeric_limits<std::uint64_t>::max() / row &&
                   canHold(layout, fileBytes, array.rows * row);
  return array;
}

// ---- rows ----

/// Goes through the rows of an array once.
class Rows {
 public:
  virtual ~Rows() = default;
  Rows(const Hdf5Library::Impl& file, Handle dataset, const Hdf5Array& array, std::string what)
      : file_(file),
        dataset_(std::move(dataset)),
        fileType_(H5Dget_type(dataset_)),
        array_(array),
        what_(std::move(what)),
        fileSize_(std::max<std::size_t>(1, H5Tget_size(fileType_))),
        layout_(layoutOf(dataset_, fileSize_)) {
    const std::size_t row = std::max(fileSize_, numberSize(array_.type)) * array_.arity;
    perBlock_ = std::max<std::uint64_t>(1, kBlockBytes / row);
    // Whole chunks, or each would be unpacked again and again.
    if (layout_.kind == H5D_CHUNKED)
      perBlock_ = (perBlock_ + layout_.chunk[0] - 1) / layout_.chunk[0] * layout_.chunk[0];
  }

  /// The next rows, in place of what `rows` holds, and how many; 0 at the end.
  std::size_t next(std::vector<std::byte>& rows) {
    const auto here = static_cast<std::size_t>(std::min<std::uint64_t>(perBlock_, array_.rows - done_));
    if (here > 0) fill(rows, here);
    done_ += here;
    return here;
  }

 protected:
  virtual void fill(std::vector<std::byte>& rows, std::size_t count) = 0;
  [[noreturn]] void fail(const std::string& got) const {
    file_.fail(fmt::format("{}, row {} on", what_, done_), fmt::format("numbers of {} rows", array_.rows), got,
               "the file is cut off or damaged");
  }

  const Hdf5Library::Impl& file_;
  const Handle dataset_, fileType_;
  const Hdf5Array array_;
  const std::string what_;
  const std::size_t fileSize_;  ///< bytes of a number in the file
  const Layout layout_;
  std::uint64_t perBlock_ = 1, done_ = 0;
};

/// By libhdf5.
class LibraryRows : public Rows {
 public:
  using Rows::Rows;

 private:
  void fill(std::vector<std::byte>& rows, std::size_t count) override {
    rows.resize(count * array_.arity * numberSize(array_.type));
    const Handle from(H5Dget_space(dataset_));
    const hsize_t begin[2] = {done_, 0}, size[2] = {count, array_.arity};
    const Handle to(H5Screate_simple(H5Sget_simple_extent_ndims(from), size, nullptr));
    if (H5Sselect_hyperslab(from, H5S_SELECT_SET, begin, nullptr, size, nullptr) < 0 ||
        H5Dread(dataset_, memoryType(array_.type), to, from, H5P_DEFAULT, rows.data()) < 0)
      fail(reason());
  }
};

/// Chunks that are shuffled, deflated and checksummed, each to no more than its size.
class DeflatedRows : public Rows {
 public:
  using Rows::Rows;

 private:
  void fill(std::vector<std::byte>& rows, std::size_t count) override {
    const std::size_t arity = array_.arity, size = numberSize(array_.type);
    rows.resize(count * arity * std::max(size, fileSize_));
    for (std::uint64_t row = 0; row < count; row += layout_.chunk[0])
      for (hsize_t column = 0; column < arity; column += layout_.chunk[1]) {
        readChunk(done_ + row, column);
        const std::size_t columns = std::min<std::size_t>(layout_.chunk[1], arity - column) * fileSize_;
        const std::size_t end = std::min<std::size_t>(count, row + layout_.chunk[0]);
        for (std::size_t r = row; r < end; ++r)
          std::memcpy(&rows[(r * arity + column) * fileSize_], &plain_[(r - row) * layout_.chunk[1] * fileSize_],
                      columns);
      }
    if (H5Tconvert(fileType_, memoryType(array_.type), count * arity, rows.data(), nullptr, H5P_DEFAULT) < 0)
      fail(reason());
    rows.resize(count * arity * size);
  }

  void readChunk(hsize_t row, hsize_t column) {
    const hsize_t at[2] = {row, column};
    hsize_t bytes = 0;
    if (H5Dget_chunk_storage_size(dataset_, at, &bytes) < 0) fail(reason());
    if (bytes == 0) fail("a chunk that was never written");
    if (bytes > file_.bytes) fail(fmt::format("a chunk of {} bytes in a file of {}", bytes, file_.bytes));
    plain_.resize(bytes);
    std::uint32_t left_out = 0;
    if (H5Dread_chunk(dataset_, H5P_DEFAULT, at, &left_out, plain_.data()) < 0) fail(reason());
    for (std::size_t k = layout_.steps.size(); k-- > 0;) {
      if ((left_out >> k & 1) != 0) continue;
      switch (layout_.steps[k]) {
        case H5Z_FILTER_FLETCHER32: dropChecksum(); break;
        case H5Z_FILTER_DEFLATE: inflateChunk(layout_.chunkBytes + 4 * k); break;  // checksums before it
        default: unshuffle(); break;
      }
    }
    if (plain_.size() != layout_.chunkBytes)
      fail(fmt::format("a chunk of {} bytes instead of {}", plain_.size(), layout_.chunkBytes));
  }

  /// Four bytes behind the data; zlib has its own sum of what matters.
  void dropChecksum() {
    if (plain_.size() < 4) fail("a chunk without its checksum");
    plain_.resize(plain_.size() - 4);
  }

  void inflateChunk(std::uint64_t most) {
    if (most / kDeflateExpansion > plain_.size())
      fail(fmt::format("a chunk of {} bytes that stands for {}", plain_.size(), layout_.chunkBytes));
    other_.resize(most);
    uLongf size = most;
    const int status = uncompress(reinterpret_cast<Bytef*>(other_.data()), &size,
                                  reinterpret_cast<const Bytef*>(plain_.data()), plain_.size());
    if (status != Z_OK) fail("a chunk that zlib cannot unpack to its size");
    other_.resize(size);
    plain_.swap(other_);
  }

  /// Byte k of all numbers stands together (HDF5's shuffle); what is left over stays at the end.
  void unshuffle() {
    const std::size_t numbers = plain_.size() / fileSize_;
    if (fileSize_ == 1 || numbers <= 1) return;
    other_.resize(plain_.size());
    for (std::size_t k = 0; k < fileSize_; ++k) {
      const std::byte* from = plain_.data() + k * numbers;
      std::byte* to = other_.data() + k;
      for (std::size_t i = 0; i < numbers; ++i, to += fileSize_) *to = from[i];
    }
    std::copy(plain_.begin() + static_cast<std::ptrdiff_t>(numbers * fileSize_), plain_.end(),
              other_.begin() + static_cast<std::ptrdiff_t>(numbers * fileSize_));
    plain_.swap(other_);
  }

  std::vector<std::byte> plain_, other_;
};

/// An attribute as metadata; none: it is too long, or neither numbers nor a text of fixed length.
std::optional<Metadata> metadataOf(hid_t attribute, std::string name) {
  const Handle type(H5Aget_type(attribute)), space(H5Aget_space(attribute));
  if (!type.ok() || !space.ok()) return std::nullopt;
  const hssize_t count = H5Sget_simple_extent_npoints(space);
  if (count < 1 || count > static_cast<hssize_t>(kMostNumbers)) return std::nullopt;
  if (const auto number = numberType(type)) {
    std::string bytes(static_cast<std::size_t>(count) * std::max<std::size_t>(8, H5Tget_size(type)), '\0');
    if (H5Aread(attribute, memoryType(*number), bytes.data()) < 0) return std::nullopt;
    bytes.resize(static_cast<std::size_t>(count) * numberSize(*number));
    return Metadata{"", std::move(name), static_cast<std::int32_t>(*number), std::move(bytes)};
  }
  const std::size_t size = H5Tget_size(type);
  if (H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) != 0 || count != 1 || size > kMostText)
    return std::nullopt;
  std::string text(size + 1, '\0');
  if (H5Aread(attribute, type, text.data()) < 0) return std::nullopt;
  text.resize(std::strlen(text.c_str()));
  return Metadata::text("", std::move(name), std::move(text));
}

}  // namespace

std::vector<Hdf5Array> Hdf5Library::Impl::arrays(hid_t group) const {
  std::vector<Hdf5Array> found;
  for (std::string& name : namesIn(group)) {
    const Handle dataset(H5Dopen2(group, name.c_str(), H5P_DEFAULT));
    if (!dataset.ok()) continue;
    if (auto array = arrayOf(dataset, std::move(name), bytes)) found.push_back(std::move(*array));
  }
  return found;
}

std::vector<Metadata> Hdf5Library::Impl::attributes(hid_t group) const {
  std::vector<Metadata> found;
  std::vector<std::string> names;
  H5Aiterate2(
      group, H5_INDEX_NAME, H5_ITER_INC, nullptr,
      [](hid_t, const char* name, const H5A_info_t*, void* to) {
        auto& all = *static_cast<std::vector<std::string>*>(to);
        all.emplace_back(name);
        return herr_t{all.size() < kMostNames ? 0 : 1};
      },
      &names);
  for (std::string& name : names) {
    const Handle attribute(H5Aopen(group, name.c_str(), H5P_DEFAULT));
    if (!attribute.ok()) continue;
    if (auto value = metadataOf(attribute, std::move(name))) found.push_back(std::move(*value));
  }
  return found;
}

Hdf5Library::Hdf5Library(const std::string& path) : impl_(std::make_unique<Impl>(path)) {}
Hdf5Library::~Hdf5Library() = default;

std::vector<Hdf5Group> Hdf5Library::groups() const {
  std::vector<Hdf5Group> found;
  const Handle root(H5Gopen2(impl_->file, "/", H5P_DEFAULT));
  if (!root.ok()) impl_->fail("HDF5", "a root group", reason());
  found.push_back({"", impl_->arrays(root), impl_->attributes(root)});
  for (std::string& name : namesIn(root)) {
    const Handle group(H5Gopen2(root, name.c_str(), H5P_DEFAULT));
    if (group.ok()) found.push_back({std::move(name), impl_->arrays(group), impl_->attributes(group)});
  }
  return found;
}

void Hdf5Library::rows(const std::string& group, const Hdf5Array& array,
                       const std::function<void(std::span<const std::byte>)>& take) const {
  const std::string what = fmt::format("HDF5, {}/{}", group, array.name);
  Handle dataset(
      H5Dopen2(impl_->file, fmt::format("/{}{}{}", group, group.empty() ? "" : "/", array.name).c_str(), H5P_DEFAULT));
  if (!dataset.ok()) impl_->fail(what, "a dataset", reason());
  const auto now = arrayOf(dataset, array.name, impl_->bytes);
  if (!now || now->rows != array.rows || now->arity != array.arity || now->type != array.type || !now->stored)
    impl_->fail(what, fmt::format("numbers of {} rows in {} bytes of file", array.rows, impl_->bytes),
                now && now->rows == array.rows ? "fewer" : "others than before", "the file is cut off or damaged");
  const Handle type(H5Dget_type(dataset));
  const Layout layout = layoutOf(dataset, H5Tget_size(type));
  for (const H5Z_filter_t filter : layout.steps)
    if (H5Zfilter_avail(filter) <= 0)
      impl_->fail(what, "filters that libhdf5 has", filterName(filter),
                  "h5repack -f GZIP=4 IN OUT makes a file of it that everybody can read");
  std::unique_ptr<Rows> rows;
  if (layout.ownPath)
    rows = std::make_unique<DeflatedRows>(*impl_, std::move(dataset), array, what);
  else
    rows = std::make_unique<LibraryRows>(*impl_, std::move(dataset), array, what);
  std::vector<std::byte> block;
  while (rows->next(block) > 0) take(block);
}

}  // namespace mote

#endif
