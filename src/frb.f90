!> The public interface of the library: the exact motion of a free rigid body. All names listed here are
!> public. Import those you use, as the first example does: `use frb, only: wp, rigid_body, free_flow`.
module frb
    use frb_kinds, only: wp
    use frb_status, only: status_message, status_ok, status_bad_moments, status_bad_tensor, &
        status_bad_momentum, status_bad_attitude, status_bad_time, status_bad_count, status_bad_option, &
        status_bad_torque, status_bad_scheme, status_no_period, status_lapack_failed, status_stopped, &
        status_not_offered, status_too_rough
    use frb_rotations, only: quat_product, quat_conjugate, quat_to_matrix, matrix_to_quat
    use frb_inertia, only: principal_axes
    use frb_matrix_step, only: frb_step
    use frb_quat_step, only: quat_step
    use frb_free_flow, only: flow_tangent, free_flow, rigid_body
    use frb_free_flow_many, only: free_flow, free_flow_columns
    use frb_free_motion, only: free_motion
    use frb_elliptic, only: carlson_rf => rf, carlson_rc => rc, carlson_rj => rj, carlson_rd => rd, &
        jacobi_functions => jacobi, ellip_k, ellip_f, jacobi_am, ellpi, ellint_pi, eint_gauss
    use frb_order_conditions, only: order_report, order_conditions
    use frb_schemes, only: splitting_scheme, scheme_names, mirrored
    use frb_torque, only: body_scene, group_scene, body_observer, group_observer, body_drift, &
        scene_lanes
    use frb_scenes, only: heavy_top, plain_scene
    use frb_drifts, only: flow_drift, matrix_drift, quaternion_drift, drift_by_name
    use frb_frames, only: angular_velocity, angular_momentum, quat_rotate, quat_rotate_back, quat_momentum, &
        momentum_from_quat
    use frb_thermostats, only: langevin_kick
    use frb_splitting, only: integrate
    use frb_extrapolation, only: extrapolate, extrapolation_report
    use frb_splitting_plan, only: splitting_plan
    use frb_splitting_tangent, only: integrate_tangent
    use frb_invariants, only: kinetic_energy, total_energy, spatial_momentum, norm_defect, invariant_monitor
    implicit none
    public

end module frb
