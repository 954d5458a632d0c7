// Meshes as they come from files, the tree over them, and shadow rays: no leak, and what brute force says.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

#include "host/core/error.h"
#include "host/core/log.h"
#include "host/core/parallel.h"
#include "host/core/random.h"
#include "host/solids/mesh.h"
#include "host/solids/occlusion.h"
#include "host/solids/solid_tree.h"
#include "tests/support/lights.h"
#include "tests/support/solids.h"
#include "tests/support/temp_folder.h"

namespace mote {
namespace {

Solid solidOf(const std::string& file) {
  Solid solid;
  solid.file = file;
  return solid;
}

Mesh sharedMesh(const std::string& name) {
  return loadMesh(solidOf(std::string(MOTE_SHARED_DATA) + "/mesh/" + name), 1);
}

void expectBounds(const Mesh& mesh, const vec3& lo, const vec3& hi, float tolerance) {
  const Bounds bounds = mesh.bounds();
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(bounds.lo[axis], lo[axis], tolerance) << axis;
    EXPECT_NEAR(bounds.hi[axis], hi[axis], tolerance) << axis;
  }
}

std::string messageOf(const Solid& solid, int frame = 1) {
  try {
    loadMesh(solid, frame);
  } catch (const InputError& error) {
    return error.what();
  }
  return "nothing was thrown";
}

// ---- meshes ----

TEST(Mesh, ReadsObjFilesWithQuadsAndWithout) {
  const Mesh spot = sharedMesh("spot.obj");
  EXPECT_EQ(spot.triangles.size(), 5856u);
  expectBounds(spot, {-0.47155f, -0.73678f, -0.66891f}, {0.47155f, 0.95365f, 1.049f}, 1e-5f);  // the file's digits
  ASSERT_EQ(spot.normal.size(), spot.position.size());                                         // smooth ones were made
  const Mesh suzanne = sharedMesh("suzanne.obj");
  EXPECT_GT(suzanne.triangles.size(), 900u);  // 500 faces, nearly all of them quads
  expectBounds(suzanne, {-3.8613f, 0.26731f, 3.2523f}, {-1.1269f, 2.2361f, 4.9555f}, 1e-4f);
  ASSERT_EQ(suzanne.normal.size(), suzanne.position.size());
  for (const auto& triangle : suzanne.triangles)
    for (const std::uint32_t corner : triangle) EXPECT_NEAR(glm::length(suzanne.normal[corner]), 1, 1e-6);
}

/// Corners that the file shares between faces at right angles do not make the faces round.
TEST(Mesh, MakesNormalsThatKeepSharpEdges) {
  const test::TempFolder folder;
  test::writeBytes(folder.file("cube.ply"),
                   "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n"
                   "element face 6\nproperty list uchar int vertex_indices\nend_header\n"
                   "-1 -1 -1\n1 -1 -1\n1 1 -1\n-1 1 -1\n-1 -1 1\n1 -1 1\n1 1 1\n-1 1 1\n"
                   "4 0 3 2 1\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n");
  Solid cubeSolid;
  cubeSolid.file = folder.file("cube.ply");
  const Mesh cube = loadMesh(cubeSolid, 1);
  ASSERT_EQ(cube.triangles.size(), 12u);
  for (const auto& [a, b, c] : cube.triangles) {
    const vec3 face =
        glm::normalize(glm::cross(cube.position[b] - cube.position[a], cube.position[c] - cube.position[a]));
    for (const std::uint32_t corner : {a, b, c}) EXPECT_LE(glm::length(cube.normal[corner] - face), 1e-5f);
  }
}

TEST(Mesh, ReadsBinaryAndAsciiStl) {
  // A tetrahedron with its right angle at the origin; its normals are for the reader to make or to take.
  const vec3 corners[] = {{0, 0, 0}, {2, 0, 0}, {0, 3, 0}, {0, 0, 4}};
  const std::array<int, 3> faces[] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  std::string ascii = "solid tetrahedron\n", binary(80, ' ');
  const auto put = [&](const auto& value) { binary.append(reinterpret_cast<const char*>(&value), sizeof value); };
  put(std::uint32_t{4});
  for (const auto& [a, b, c] : faces) {
    const vec3 normal = glm::normalize(glm::cross(corners[b] - corners[a], corners[c] - corners[a]));
    ascii += fmt::format("  facet normal {} {} {}\n    outer loop\n", normal.x, normal.y, normal.z);
    put(normal);
    for (const int k : {a, b, c}) {
      ascii += fmt::format("      vertex {} {} {}\n", corners[k].x, corners[k].y, corners[k].z);
      put(corners[k]);
    }
    ascii += "    endloop\n  endfacet\n";
    put(std::uint16_t{0});
  }
  ascii += "endsolid tetrahedron\n";
  ASSERT_EQ(binary.size(), 84u + 4 * 50);
  const test::TempFolder folder;
  test::writeBytes(folder.file("ascii.stl"), ascii);
  test::writeBytes(folder.file("binary.stl"), binary);
  for (const char* name : {"ascii.stl", "binary.stl"}) {
    const Mesh mesh = loadMesh(solidOf(folder.file(name)), 1);
    ASSERT_EQ(mesh.triangles.size(), 4u) << name;
    expectBounds(mesh, {0, 0, 0}, {2, 3, 4}, 0);
    double volume = 0;  // 2 · 3 · 4 / 6, counted with the side that each triangle shows
    for (std::size_t k = 0; k < 4; ++k) {
      const layout::Triangle t = mesh.triangle(k);
      volume += glm::dot(dvec3(t.a), glm::cross(dvec3(t.b), dvec3(t.c))) / 6;
      const vec3 face = glm::normalize(glm::cross(t.b - t.a, t.c - t.a));
      for (const std::uint32_t corner : mesh.triangles[k])
        EXPECT_LE(glm::length(mesh.normal[corner] - face), 1e-5f) << name << " " << k;
    }
    EXPECT_NEAR(volume, 4, 1e-6) << name;
  }
}

TEST(Mesh, AppliesTheNodesOfGltf) {
  const Mesh box = sharedMesh("Box_embedded.gltf");
  EXPECT_EQ(box.triangles.size(), 12u);
  expectBounds(box, vec3(-0.5f), vec3(0.5f), 1e-6f);
  // The duck's points lie in ±170; the node above scales them by 0.01.
  const Mesh duck = sharedMesh("Duck.glb");
  EXPECT_EQ(duck.triangles.size(), 4212u);
  expectBounds(duck, {-0.69299f, 0.099294f, -0.61328f}, {0.9618f, 1.6397f, 0.53925f}, 1e-5f);
}

TEST(Mesh, ScalesThenRotatesThenMoves) {
  test::TempFolder folder;
  test::writeBytes(folder.file("a.obj"), "v 0 0 0\nv 1 0 0\nv 0 0 1\nvn 0 1 0\nf 1//1 2//1 3//1\n");
  Solid solid = solidOf(folder.file("a.obj"));
  solid.scale = 2;
  solid.rotate = {90, 0, 90};  // x → x → y and z → −y → x
  solid.translate = {10, 20, 30};
  const Mesh mesh = loadMesh(solid, 1);
  ASSERT_EQ(mesh.triangles.size(), 1u);
  const layout::Triangle t = mesh.triangle(0);
  // Exact but for sin and cos of 90° in double.
  EXPECT_LE(glm::length(t.a - vec3(10, 20, 30)), 1e-6f);
  EXPECT_LE(glm::length(t.b - vec3(10, 22, 30)), 1e-6f);
  EXPECT_LE(glm::length(t.c - vec3(12, 20, 30)), 1e-6f);
  EXPECT_LE(glm::length(mesh.normal[mesh.triangles[0][0]] - vec3(0, 0, 1)), 1e-6f);  // y → z → z
}

TEST(Mesh, LeavesOutBadTrianglesWithOneWarning) {
  takeWarnings();
  test::TempFolder folder;
  test::writeBytes(folder.file("bad.obj"),
                   "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 0 0\nv nan 0 0\nf 1 2 3\nf 1 2 4\nf 1 1 2\nf 1 3 5\nl 1 2\n");
  const Mesh mesh = loadMesh(solidOf(folder.file("bad.obj")), 1);
  EXPECT_EQ(mesh.triangles.size(), 1u);
  const std::vector<std::string> warnings = takeWarnings();
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("bad.obj: 2 triangles without area and 1 not finite were left out of 4"),
            std::string::npos)
      << warnings[0];
}

TEST(Mesh, TakesTheFrameOfASequence) {
  test::TempFolder folder;
  test::writeBytes(folder.file("a.0007.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_EQ(loadMesh(solidOf(folder.file("a.####.obj")), 7).triangles.size(), 1u);
  EXPECT_NE(messageOf(solidOf(folder.file("a.####.obj")), 8).find("only frame 7 exists"), std::string::npos);
}

TEST(Mesh, RefusesWhatIsNoMeshWithASentence) {
  test::TempFolder folder;
  test::writeBytes(folder.file("ground.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
  test::writeBytes(folder.file("noise.ply"), "what is this");
  test::writeBytes(folder.file("line.obj"), "v 0 0 0\nv 1 0 0\nl 1 2\n");
  test::writeBytes(folder.file("a.xyzzy"), "1 2 3");
  EXPECT_NE(
      messageOf(solidOf(folder.file("grund.obj"))).find("no such file (nearest names in its folder: 'ground.obj'"),
      std::string::npos);
  EXPECT_NE(messageOf(solidOf(folder.path())).find("expected a mesh, got a folder"), std::string::npos);
  for (const char* name : {"ground.obj", "noise.ply", "line.obj", "a.xyzzy"}) {
    const std::string message = messageOf(solidOf(folder.file(name)));
    EXPECT_NE(message.find(folder.file(name) + ": expected a mesh"), std::string::npos) << message;
  }
}

// ---- the tree ----

TEST(SolidTree, KeepsThePromisesOfTheLayout) {
  for (const int cells : {1, 2, 9}) EXPECT_EQ(validate(buildSolidTree(test::trianglesOf(test::boxMesh(cells)))), "");
  const SolidTree spot = buildSolidTree(test::trianglesOf(sharedMesh("spot.obj")));
  EXPECT_EQ(validate(spot), "");
  EXPECT_LT(spot.nodeCount(), 2 * spot.triangles.size());
  const SolidTree one = buildSolidTree(std::vector<layout::Triangle>{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}});
  EXPECT_EQ(validate(one), "");
  EXPECT_EQ(one.nodeCount(), 1u);
  // A thousand at one place: no split parts them.
  EXPECT_EQ(validate(buildSolidTree(std::vector<layout::Triangle>(1000, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}))), "");
  const SolidTree none = buildSolidTree({});
  EXPECT_EQ(validate(none), "");
  EXPECT_EQ(none.nodeCount(), 0u);
}

TEST(SolidTree, ValidateSeesEachBrokenPromise) {
  const SolidTree good = buildSolidTree(test::trianglesOf(test::boxMesh(3)));
  ASSERT_EQ(validate(good), "");
  const auto broken = [&](const auto& change) {
    SolidTree tree = good;
    change(tree);
    return validate(tree);
  };
  EXPECT_NE(broken([](SolidTree& t) { t.source[3] = t.source[4]; }), "");
  EXPECT_NE(broken([](SolidTree& t) { t.nodes[1].lo.x += 0.01f; }), "");
  EXPECT_NE(broken([](SolidTree& t) { t.nodes[2].skip = 2; }), "");
  EXPECT_NE(broken([](SolidTree& t) { t.nodes[1].first += 1; }), "");
  EXPECT_NE(broken([](SolidTree& t) { t.nodes[0].skip -= 1; }), "");
  EXPECT_NE(broken([](SolidTree& t) { t.nodes.back().first -= 1; }), "");
}

TEST(SolidTree, IsTheSameForAnyNumberOfThreads) {
  // Many triangles with equal centres as well: there the builder falls back on the order it has.
  std::vector<layout::Triangle> triangles = test::trianglesOf(test::ballMesh(60, {1, 2, 3}, 2));
  triangles.insert(triangles.end(), 5000, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
  const SolidTree all = buildSolidTree(triangles);
  const ThreadLimit one(1);
  const SolidTree single = buildSolidTree(triangles);
  EXPECT_EQ(all.source, single.source);
  ASSERT_EQ(all.nodes.size(), single.nodes.size());
  EXPECT_EQ(std::memcmp(all.nodes.data(), single.nodes.data(), all.nodes.size() * sizeof(layout::Node)), 0);
}

TEST(SolidTree, TakesOnlySolidsThatCastShadows) {
  const std::vector<Mesh> meshes{test::boxMesh(1), test::boxMesh(2)};
  std::vector<Solid> solids(2);
  EXPECT_EQ(shadowTriangles(solids, meshes).size(), 12u + 48u);
  solids[0].castsShadows = false;
  solids[1].mode = SolidMode::Hidden;  // not in the picture, still in the light
  EXPECT_EQ(shadowTriangles(solids, meshes).size(), 48u);
}

// ---- shadow rays ----

std::size_t countLit(const std::vector<std::uint8_t>& occlusion) {
  return static_cast<std::size_t>(std::count(occlusion.begin(), occlusion.end(), 0));
}

TEST(Occlusion, NothingLeaksOutOfAClosedMesh) {
  const auto turn = [](const vec3& p) {  // no coordinate is left round
    const double s = std::sin(0.7), c = std::cos(0.7);
    return vec3(
        glm::dvec3(c * p.x - s * p.y, c * s * p.x + c * c * p.y - s * p.z, s * s * p.x + s * c * p.y + c * p.z));
  };
  const std::vector<Mesh> meshes{test::boxMesh(1), test::boxMesh(8), test::boxMesh(8, turn),
                                 test::ballMesh(12, {0, 0, 0}, 1)};
  std::size_t rays = 0;
  for (const Mesh& mesh : meshes) {
    const SolidTree tree = buildSolidTree(test::trianglesOf(mesh));
    for (const vec3& eye : {vec3(0), vec3(0.25f, -0.5f, 0.125f), vec3(0.31f, 0.017f, -0.43f), vec3(0, 0, 0.53f)}) {
      const test::Points points = test::pointsBehind(mesh, eye, 70'000);
      rays += points.x.size();
      EXPECT_EQ(countLit(occluded(tree, points.receivers(), {}, pointLight(eye))), 0u);
    }
  }
  EXPECT_GE(rays, 1'000'000u);
}

TEST(Occlusion, NothingLeaksFarFromTheOrigin) {
  // Coordinates of 1000 have steps of 6e-5: corners move, but with all their triangles.
  const Mesh mesh = test::ballMesh(10, {1000, -700, 400}, 1);
  const SolidTree tree = buildSolidTree(test::trianglesOf(mesh));
  const vec3 eye(1000.25f, -700.125f, 400.5f);
  EXPECT_EQ(countLit(occluded(tree, test::pointsBehind(mesh, eye, 100'000).receivers(), {}, pointLight(eye))), 0u);
}

TEST(Occlusion, NothingLeaksFromAFarLight) {
  // Points inside, rays of 1e4 sizes; and endless ones along an axis, along a diagonal and askew.
  const Mesh mesh = test::boxMesh(5);
  const SolidTree tree = buildSolidTree(test::trianglesOf(mesh));
  test::Points points;
  for (int i = 0; i < 50'000; ++i) {
    Random random(9, static_cast<std::uint64_t>(i));
    points.add({random.uniform(-0.9, 0.9), random.uniform(-0.9, 0.9), random.uniform(-0.9, 0.9)});
  }
  for (int i = -4; i <= 4; ++i)
    for (int j = -4; j <= 4; ++j)  // behind corners and edges of the squares
      points.add({static_cast<float>(i) * 0.2f, static_cast<float>(j) * 0.2f, 0});
  EXPECT_EQ(countLit(occluded(tree, points.receivers(), {}, pointLight({6000, 7000, -4000}))), 0u);
  for (const vec3& direction : {vec3(0, 0, 1), vec3(-1, 0, 0), vec3(1, 1, 1), vec3(0, 1, -1), vec3(0.3f, -0.8f, 0.1f)})
    EXPECT_EQ(countLit(occluded(tree, points.receivers(), {}, directionalLight(direction))), 0u);
}

/// Distance of the ray's crossing from the triangle's edges in barycentric terms and t, in double; the smaller, the
/// nearer is the decision. > 0: a hit.
double hitMargin(const dvec3& origin, const dvec3& direction, bool bounded, const layout::Triangle& triangle) {
  const dvec3 a = dvec3(triangle.a) - origin, b = dvec3(triangle.b) - origin, c = dvec3(triangle.c) - origin;
  const double u = glm::dot(glm::cross(c, b), direction), v = glm::dot(glm::cross(a, c), direction),
               w = glm::dot(glm::cross(b, a), direction), sum = u + v + w;
  const double t = -glm::dot(a, glm::cross(c - a, b - a)) / -sum;
  const double inside = std::min({u / sum, v / sum, w / sum, t});
  return bounded ? std::min(inside, 1 - t) : inside;
}

/// Rays in all directions through the mesh's box, some of them to a light inside.
void expectBruteForce(const Mesh& mesh, const layout::Light& light, std::size_t count) {
  const std::vector<layout::Triangle> triangles = test::trianglesOf(mesh);
  const SolidTree tree = buildSolidTree(triangles);
  const Bounds bounds = mesh.bounds();
  test::Points points;
  for (std::size_t i = 0; i < count; ++i) {
    Random random(31, i);
    vec3 p;
    for (int axis = 0; axis < 3; ++axis)
      p[axis] = static_cast<float>(bounds.lo[axis] + (1.4 * random.uniform() - 0.2) * bounds.size()[axis]);
    points.add(p);
  }
  const Receivers receivers = points.receivers();
  const std::vector<std::uint8_t> walked = occluded(tree, receivers, {}, light);
  const bool bounded = light.type != layout::kLightDirectional;
  std::vector<std::uint8_t> wrong(count, 0), near(count, 0);
  parallelBlocks(count, 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const dvec3 origin(receivers.position(i));
      const dvec3 direction = bounded ? dvec3(light.position) - origin : -dvec3(light.direction);
      double best = -1e30;
      for (const layout::Triangle& triangle : triangles)
        best = std::max(best, hitMargin(origin, direction, bounded, triangle));
      // So near an edge or an end float may see it either way: corners are good to 1e-6 of the ray's length, which is
      // a hundred times a triangle's.
      near[i] = std::abs(best) < 1e-4;
      wrong[i] = !near[i] && (best > 0) != (walked[i] != 0);
    }
  });
  EXPECT_EQ(std::accumulate(wrong.begin(), wrong.end(), 0), 0);
  EXPECT_LE(std::accumulate(near.begin(), near.end(), std::size_t{0}), count / 100);
  const std::size_t lit = countLit(walked);
  EXPECT_GT(lit, count / 20);  // the rays are a fair mix
  EXPECT_LT(lit, count * 19 / 20);
}

TEST(Occlusion, AgreesWithEveryTriangleInDoublePrecision) {
  const Mesh spot = sharedMesh("spot.obj");
  expectBruteForce(spot, pointLight({1.5f, 2, 1}), 50'000);
  expectBruteForce(spot, pointLight({0.05f, 0.1f, 0.2f}), 25'000);  // inside
  expectBruteForce(spot, directionalLight({0.2f, -1, 0.4f}), 25'000);
}

TEST(Occlusion, ALightInsideAClosedMeshLightsNothingOutside) {
  const Mesh spot = sharedMesh("spot.obj");
  const SolidTree tree = buildSolidTree(test::trianglesOf(spot));
  const vec3 inside(0.0f, 0.1f, 0.1f);
  EXPECT_EQ(countLit(occluded(tree, test::pointsBehind(spot, inside, 200'000).receivers(), {}, pointLight(inside))),
            0u);
}

TEST(Occlusion, ReachesFromThePointToTheLightAndNoFurther) {
  const SolidTree tree = buildSolidTree(std::vector<layout::Triangle>{{{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}}});
  test::Points points;
  for (const float z : {-2.0f, -1e-6f, 1e-6f, 2.0f}) points.add({0, 0, z});
  const auto flags = [&](const layout::Light& light) { return occluded(tree, points.receivers(), {}, light); };
  using Flags = std::vector<std::uint8_t>;
  EXPECT_EQ(flags(pointLight({0, 0, 3})), (Flags{1, 1, 0, 0}));
  EXPECT_EQ(flags(pointLight({0, 0, -3})), (Flags{0, 0, 1, 1}));  // both sides count
  EXPECT_EQ(flags(pointLight({0, 0, -1e-3f})), (Flags{0, 0, 1, 1}));
  EXPECT_EQ(flags(directionalLight({0, 0, -1})), (Flags{1, 1, 0, 0}));
  EXPECT_EQ(flags(directionalLight({0, 0, 1})), (Flags{0, 0, 1, 1}));
  EXPECT_EQ(flags(pointLight({5, 0, 3})), (Flags{0, 1, 0, 0}));
}

TEST(Occlusion, AsksOnlyWhatIsWantedAndOnlyLightsThatCastShadows) {
  const SolidTree tree = buildSolidTree(test::trianglesOf(test::boxMesh()));
  test::Points points;
  for (int i = 0; i < 4; ++i) points.add({0, 0, 0});
  using Flags = std::vector<std::uint8_t>;
  layout::Light light = pointLight({0, 5, 0});
  EXPECT_EQ(occluded(tree, points.receivers(), Flags{1, 0, 0, 1}, light), (Flags{1, 0, 0, 1}));
  light.castsShadows = 0;
  EXPECT_EQ(occluded(tree, points.receivers(), {}, light), Flags(4, 0));
  EXPECT_EQ(occluded(buildSolidTree({}), points.receivers(), {}, pointLight({0, 5, 0})), Flags(4, 0));
}

TEST(Occlusion, IsTheSameForAnyNumberOfThreads) {
  const Mesh spot = sharedMesh("spot.obj");
  const SolidTree tree = buildSolidTree(test::trianglesOf(spot));
  const test::Points points = test::pointsBehind(spot, {0.5f, 0.9f, 0.1f}, 20'000);
  const std::vector<std::uint8_t> all = occluded(tree, points.receivers(), {}, pointLight({0.5f, 0.9f, 0.1f}));
  const ThreadLimit one(1);
  EXPECT_EQ(all, occluded(tree, points.receivers(), {}, pointLight({0.5f, 0.9f, 0.1f})));
}

TEST(Occlusion, PointsBesideASurfaceAreNotShadedByIt) {
  // Lights from straight above down to a thousandth of a radian over the triangle's plane, slivers, far coordinates.
  std::size_t shaded = 0, asked = 0;
  for (int i = 0; i < 20'000; ++i) {
    Random random(77, static_cast<std::uint64_t>(i));
    const dvec3 far = random.direction() * std::pow(10.0, random.uniform(-1, 3));
    const dvec3 along = random.direction(), across = glm::normalize(glm::cross(along, random.direction()));
    const double length = std::pow(10.0, random.uniform(-2, 2)),
                 width = length * std::pow(10.0, random.uniform(-1.5, 0));
    const layout::Triangle triangle{far, far + along * length,
                                    far + along * length * random.uniform() + across * width};
    const dvec3 a(triangle.a), b(triangle.b), c(triangle.c), cross = glm::cross(b - a, c - a);
    if (glm::length(cross) < 1e-3 * length * width) continue;  // rounded away at far coordinates
    const dvec3 normal = glm::normalize(cross);
    double u = random.uniform(), v = random.uniform();
    if (u + v > 1) u = 1 - u, v = 1 - v;
    const vec3 point(a + u * (b - a) + v * (c - a));
    const vec3 origin(dvec3(point) + normal * double(surfaceOffset(triangle, point)));
    const double height = std::pow(10.0, random.uniform(-3, 0));
    const vec3 light(dvec3(origin) + (normal * height + glm::normalize(b - a) * std::sqrt(1 - height * height)) *
                                         length * random.uniform(0.1, 10.0));
    test::Points points;
    points.add(origin);
    shaded += occluded(buildSolidTree(std::vector{triangle}), points.receivers(), {}, pointLight(light))[0];
    ++asked;
  }
  EXPECT_GT(asked, 15'000u);
  EXPECT_EQ(shaded, 0u);
}

}  // namespace
}  // namespace mote
