#include "space/contacts/geom_copies.h"

#include <cstring>

#include "space/geom/ode_heightfield.h"

namespace ode_parallel_sap {

namespace {

bool isHeightfield(const dxGeom* geom) {
  return geom->type == dHeightfieldClass;
}

// Makes the image's heightfield one like `original`. It keeps its buffers, and reads the pose where
// it is. What is copied of a geom begins after the pointer to its virtual functions.
dxGeom* heightfieldLike(const OdeImage& image, const dxGeom* original) {
  dxGeom* const copy = image.heightfield();
  constexpr std::size_t from = sizeof(void*);
  std::memcpy(reinterpret_cast<char*>(copy) + from, reinterpret_cast<const char*>(original) + from,
              sizeof(dxGeom) - from);
  const dxHeightfieldData& data = *static_cast<const dxHeightfield*>(original)->m_p_data;
  dxHeightfieldData& own = *image.heightfieldData();
  const std::size_t before_scratch = static_cast<std::size_t>(
      reinterpret_cast<const char*>(&data.m_contacts) - reinterpret_cast<const char*>(&data));
  std::memcpy(static_cast<void*>(&own), &data, before_scratch);
  own.m_pGetHeightCallback = data.m_pGetHeightCallback;
  return copy;
}

}  // namespace

bool GeomCopies::serve(const OdeImage& image, const dxGeom* a, const dxGeom* b) {
  const dxGeom* const field = isHeightfield(a) ? a : b;
  const dxGeom* const other = field == a ? b : a;
  return isHeightfield(field) && image.sizeOf(other->type) != 0 && other->final_posr &&
         !static_cast<const dxHeightfield*>(field)->m_p_data->m_pGetHeightCallback;
}

int GeomCopies::collide(const OdeImage& image, dxGeom* a, dxGeom* b, int flags,
                        dContactGeom* contacts, int skip) {
  const bool field_first = isHeightfield(a);
  dxGeom* const field = heightfieldLike(image, field_first ? a : b);
  dxGeom* const other = copyOf(image, field_first ? b : a);
  const int count = image.collide(field_first ? field : other, field_first ? other : field, flags,
                                  contacts, skip);
  const auto original = [&](dxGeom* geom) { return (geom == field) == field_first ? a : b; };
  for (int i = 0; i < count; ++i) {
    dContactGeom& contact =
        *reinterpret_cast<dContactGeom*>(reinterpret_cast<char*>(contacts) + i * skip);
    contact.g1 = original(contact.g1);
    contact.g2 = original(contact.g2);
  }
  return count;
}

dxGeom* GeomCopies::copyOf(const OdeImage& image, const dxGeom* geom) {
  const std::size_t size = image.sizeOf(geom->type);
  bytes_.resize((size + sizeof(double) - 1) / sizeof(double));
  std::memcpy(bytes_.data(), static_cast<const void*>(geom), size);
  dxGeom* const copy = reinterpret_cast<dxGeom*>(bytes_.data());
  pose_ = *geom->final_posr;
  copy->final_posr = &pose_;
  return copy;
}

}  // namespace ode_parallel_sap
