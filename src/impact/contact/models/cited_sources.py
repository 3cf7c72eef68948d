"""Public sources of several laws, with the commit or date of the version that was read."""

GHARIB_HURMUZLU = "Gharib and Hurmuzlu (2012)"
DYS = "ladisk/DyS, MBD_system/contact_model/contact_model.py @5e6a54d (2018)"
OPENSEES_HERTZDAMP = "the OpenSees documentation, uniaxialMaterials/HertzDamp.rst @72fd8c5 (2023)"
OPENSEES_JANKOWSKI = "the OpenSees documentation, uniaxialMaterials/JankowskiImpact.rst @72fd8c5 (2023)"
IMPACT_MATERIAL = "the OpenSees wiki, Impact Material"
MBDYN = "alex-marinov/mbdyn, modules/module-cont-contact/module-cont-contact.cc @1727489e5 (2021)"
MBDYN_BIBLIOGRAPHY = "Rahuldrabit/MBDyn, manual/mybib.bib @db248e0 (2025)"
SIMBODY = "simbody/simbody, Simbody/src/HuntCrossleyForce.cpp and HuntCrossleyForce.h @f312d0dd (2026)"
DRAKE = (
    "RobotLocomotion/drake, multibody/plant/contact_model_doxygen.h and geometry/scene_graph_config.h @be259df724 "
    "(2026)"
)
MODIA3D = "ModiaSim/Modia3D.jl, src/Composition/responseCalculation/elasticCollisionResponse.jl"
MUJOCO = "google-deepmind/mujoco, doc/modeling.rst and src/engine/engine_core_constraint.c @a7255075b (2026)"
CHRONO = "projectchrono/chrono, src/chrono/physics/ChContactSMC.cpp @7689fbc02d (2026)"
CHRONO_MULTICORE = (
    "projectchrono/chrono, src/chrono_multicore/solver/ChIterativeSolverMulticoreSMC.cpp @7689fbc02d (2026)"
)
RIGID_BODY_DYNAMICS = "JuliaRobotics/RigidBodyDynamics.jl, src/contact.jl @d6df4ebe (2024)"
RAILWAY = "sflabbe/railway-impact-simulator, src/railway_simulator/core/contact.py @9f35904 (2026)"
EXUDYN = "jgerstmayr/EXUDYN, main/src/Objects/CObjectContactSphereSphere.cpp @e44aca1b (2026)"
LETHE = (
    "chaos-polymtl/lethe, include/dem/particle_particle_contact_force.h @0092035b and effective_properties.h "
    "@8bf81c3b, doc/source/theory/dem/dem.rst @023e4352"
)
LIGGGHTS = "CFDEMproject/LIGGGHTS-PUBLIC @3d5c00f2 (3.8.0, 2024), src/"
KRATOS = "KratosMultiphysics/Kratos, applications/DEMApplication"
YADE_2025 = "c61292558/yade4deepin, a copy of YADE 2025.2.0, pkg/dem/ @f1486c0 (2025)"
DEMLAB_VISCOELASTIC = (
    "rlrangel/DEMLab, src/interactions/force/ContactForceN_ViscoElasticNonlinear.m @23e741d (2024)"
)
DEMLAB_PLASTIC = "rlrangel/DEMLab, src/interactions/force/ContactForceN_ElastoPlasticLinear.m @23e741d (2024)"
YADE_BIBLIOGRAPHY = "c61292558/yade4deepin, doc/references.bib @f1486c0 (2025)"
MAPLESIM_HELP = "the MapleSim help, Multibody Contact Modes (read in November 2026)"
