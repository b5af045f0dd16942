#include "engine/world.h"

#include <box2d/box2d.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "engine/trigonometry.h"

namespace kilotwin {

namespace {

constexpr double RADIUS_UNITS = 0.1;
constexpr int ROUND_WALL_SEGMENTS = 720;  // a 19.2 m arena differs from a circle by 0.1 mm
constexpr float FRICTION = 0.3f;
constexpr int SUB_STEPS = 4, SUB_STEPS_CAREFUL = 8;
constexpr double SOME_OVERLAP = 0.01, MUCH_OVERLAP = 0.02;  // of a diameter
constexpr int ROUNDS_CAREFUL = 3;
constexpr double SPECULATIVE_UNITS = 0.018;  // Box2D's margin is 0.02

// The series of asin: a step turns a robot by little, and its sine is what Box2D's rotations give
// exactly.
double small_angle(double sine) {
    double square = sine * sine;
    return sine * (1 + square * (1.0 / 6 + square * (3.0 / 40 + square * (15.0 / 336))));
}

}  // namespace

struct World::Box2D {
    struct Disc {
        b2BodyId body = b2_nullBodyId;
        b2Transform before, now;  ///< the last step
        Shift wanted;             ///< velocity that it was last driven at
    };

    b2WorldId world;
    double units_per_m;
    double push_m_s2, push_rad_s2;
    bool gives_way;
    std::vector<Disc> discs;

    b2Vec2 to_units(const Eigen::Vector2d &v) const {
        return {static_cast<float>(v.x() * units_per_m), static_cast<float>(v.y() * units_per_m)};
    }

    void build_walls(const Arena &arena) {
        std::vector<b2Vec2> corners;
        if (arena.bounds.shape == Region::Shape::CIRCLE) {
            double half = PI / ROUND_WALL_SEGMENTS;
            double radius = arena.bounds.size.x() / 2 / direction(half).x();
            for (int i = 0; i < ROUND_WALL_SEGMENTS; i++)  // clockwise: solid from within
                corners.push_back(to_units(radius * direction(-2 * half * i)));
        } else {
            Eigen::Vector2d half = arena.bounds.size / 2;
            for (auto sign : {Eigen::Vector2d(-1, -1), Eigen::Vector2d(-1, 1),
                              Eigen::Vector2d(1, 1), Eigen::Vector2d(1, -1)})
                corners.push_back(to_units(half.cwiseProduct(sign)));
        }
        b2BodyDef ground = b2DefaultBodyDef();
        b2SurfaceMaterial material = b2DefaultSurfaceMaterial();
        material.friction = FRICTION;
        b2ChainDef chain = b2DefaultChainDef();
        chain.points = corners.data();
        chain.count = static_cast<int>(corners.size());
        chain.materials = &material;
        chain.materialCount = 1;
        chain.isLoop = true;
        b2CreateChain(b2CreateBody(world, &ground), &chain);
    }

    /// Brings a robot's velocity nearer to the wanted one (m/s, rad/s), as far as the drive's force
    /// can in `time_s`. What it wants otherwise than before it gets at once, as robots do that are
    /// not in here.
    void drive(Disc &disc, const Shift &wanted, double time_s) {
        b2Vec2 now = b2Body_GetLinearVelocity(disc.body);
        Eigen::Vector2d change = wanted.by - Eigen::Vector2d(now.x, now.y) / units_per_m;
        double most = push_m_s2 * time_s + (wanted.by - disc.wanted.by).norm(),
               size = change.norm();
        if (size > most) change *= most / size;
        b2Vec2 delta = to_units(change);
        b2Body_SetLinearVelocity(disc.body, {now.x + delta.x, now.y + delta.y});

        double spin = b2Body_GetAngularVelocity(disc.body);
        double most_spin = push_rad_s2 * time_s + std::abs(wanted.turn - disc.wanted.turn);
        double spin_change = std::clamp(wanted.turn - spin, -most_spin, most_spin);
        b2Body_SetAngularVelocity(disc.body, static_cast<float>(spin + spin_change));
        disc.wanted = wanted;
    }

    /// Lets nobody push a robot that stands.
    void stand_firm(const Disc &disc, const Shift &wanted) {
        const bool stands = wanted.by.isZero(0) && wanted.turn == 0;
        const b2BodyType type = stands ? b2_staticBody : b2_dynamicBody;
        if (b2Body_GetType(disc.body) != type) b2Body_SetType(disc.body, type);
    }

    void create(Disc &disc) {
        b2BodyDef def = b2DefaultBodyDef();
        def.type = b2_dynamicBody;
        def.enableSleep = false;
        def.isEnabled = false;
        disc.body = b2CreateBody(world, &def);
        b2ShapeDef shape = b2DefaultShapeDef();
        shape.material.friction = FRICTION;
        b2Circle circle = {{0, 0}, static_cast<float>(RADIUS_UNITS)};
        b2CreateCircleShape(disc.body, &shape, &circle);
    }
};

World::World(const Arena &arena, const Profile &profile, double drive_m_s, double fastest_m_s,
             size_t robots)
    : box2d_(std::make_unique<Box2D>()),
      held_(robots, false) {
    auto &b = *box2d_;
    b.units_per_m = RADIUS_UNITS / profile.radius_m;
    b.push_m_s2 = profile.push_m_s2;
    b.gives_way = profile.gives_way;
    b.push_rad_s2 = 2 * profile.push_m_s2 / profile.radius_m;  // a disc's inertia is m r^2 / 2
    b2WorldDef def = b2DefaultWorldDef();
    def.gravity = {0, 0};
    def.enableSleep = false;
    def.maxContactPushSpeed = static_cast<float>(drive_m_s * b.units_per_m);
    def.maximumLinearSpeed = static_cast<float>(fastest_m_s * b.units_per_m);
    b.world = b2CreateWorld(&def);
    b.discs.resize(robots);
    b.build_walls(arena);
}

World::~World() { b2DestroyWorld(box2d_->world); }

void World::add(uint32_t robot, const Trajectory &trajectory, Cycles at) {
    auto &b = *box2d_;
    auto &disc = b.discs[robot];
    if (B2_IS_NULL(disc.body)) b.create(disc);
    const Eigen::Vector2d ahead = trajectory.ahead(at), v = trajectory.drive().velocity;
    b2Body_SetTransform(disc.body, b.to_units(trajectory.position(at)),
                        {static_cast<float>(ahead.x()), static_cast<float>(ahead.y())});
    disc.now = b2Body_GetTransform(disc.body);
    b2Body_Enable(disc.body);  // first: a disabled body has no velocity
    disc.wanted = {{ahead.x() * v.x() - ahead.y() * v.y(), ahead.y() * v.x() + ahead.x() * v.y()},
                   trajectory.drive().turn};
    b2Body_SetLinearVelocity(disc.body, b.to_units(disc.wanted.by));
    b2Body_SetAngularVelocity(disc.body, static_cast<float>(disc.wanted.turn));
    held_[robot] = added_ = true;
    robots_.push_back(robot);
}

void World::remove(uint32_t robot) {
    b2Body_Disable(box2d_->discs[robot].body);
    held_[robot] = false;
    removed_ = true;
}

void World::settle() {
    auto gone = [this](uint32_t robot) { return !held_[robot]; };
    if (removed_)
        robots_.erase(std::remove_if(robots_.begin(), robots_.end(), gone), robots_.end());
    if (added_) std::sort(robots_.begin(), robots_.end());
    added_ = removed_ = false;
}

double World::margin_m(double radius_m) { return SPECULATIVE_UNITS / RADIUS_UNITS * radius_m; }

// A contact is seen by the solver only when bodies are nearer than its speculative margin at the
// begin of a solver step: two robots must not come closer than that within one.
void World::step(const std::vector<Shift> &free, double step_s, double approach_m, double overlap) {
    auto &b = *box2d_;
    if (!b.gives_way)
        for (size_t i = 0; i < robots_.size(); i++) b.stand_firm(b.discs[robots_[i]], free[i]);
    const int care = overlap > MUCH_OVERLAP ? ROUNDS_CAREFUL : 1;
    const int rounds =
        std::max(care, static_cast<int>(std::ceil(approach_m * b.units_per_m / SPECULATIVE_UNITS)));
    const double round_s = step_s / rounds;
    for (int round = 0; round < rounds; round++) {
        for (size_t i = 0; i < robots_.size(); i++)
            b.drive(b.discs[robots_[i]], {free[i].by / step_s, free[i].turn / step_s}, round_s);
        b2World_Step(b.world, static_cast<float>(round_s),
                     overlap > SOME_OVERLAP ? SUB_STEPS_CAREFUL : SUB_STEPS);
    }
    for (uint32_t robot : robots_) {
        auto &disc = b.discs[robot];
        disc.before = std::exchange(disc.now, b2Body_GetTransform(disc.body));
    }
}

Shift World::moved(uint32_t robot) const {
    const auto &b = *box2d_;
    const auto &disc = b.discs[robot];
    const auto [p0, q0] = disc.before;
    const auto [p, q] = disc.now;
    double sine = static_cast<double>(q.s) * q0.c - static_cast<double>(q.c) * q0.s;
    Eigen::Vector2d by(static_cast<double>(p.x) - p0.x, static_cast<double>(p.y) - p0.y);
    return {by / b.units_per_m, q.s == q0.s && q.c == q0.c ? 0 : small_angle(sine)};
}

std::string box2d_version() {
    b2Version v = b2GetVersion();
    return std::to_string(v.major) + "." + std::to_string(v.minor) + "." +
           std::to_string(v.revision);
}

}  // namespace kilotwin
