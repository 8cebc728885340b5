!> Numbers that the suites check and the texts state. test/claims.txt lists the sentences of README and
!> docstrings that state them, and a gate compares: change a number here, then in the texts that the gate
!> names. Relative errors of elliptic functions are in units of epsilon.
module frb_claims
    use frb_kinds, only: wp
    implicit none
    private

    public :: flow_median, flow_largest, kept_long
    public :: tangent_median, tangent_rods, tangent_largest
    public :: matrix_median, matrix_largest, frame_median, frame_largest, orthogonal
    public :: chain_norms, chain_space
    public :: rf_error, rc_error, rj_error, k_error, f_error, am_error, pi_error
    public :: nodes_error, weight_error, far_weight_error
    public :: top_energy, compensated_energy, reversed

    ! The free flow: scores in units of the inherent sensitivity; norms and energy after 1e6 and 1e7 steps.
    real(wp), parameter :: flow_median = 0.5_wp
    real(wp), parameter :: flow_largest = 2.0_wp
    real(wp), parameter :: kept_long = 1.0e-12_wp

    ! Derivatives of the free flow: scores in units of the inherent sensitivity; rods have their own median,
    ! because their turn about m is thousands of times their turn across m.
    real(wp), parameter :: tangent_median = 0.5_wp
    real(wp), parameter :: tangent_rods = 0.6_wp
    real(wp), parameter :: tangent_largest = 4.0_wp

    ! The paper's steps: scores of momentum and matrix, of quaternions in each frame; one attitude; chains.
    real(wp), parameter :: matrix_median = 1.0_wp
    real(wp), parameter :: matrix_largest = 3.0_wp
    real(wp), parameter :: frame_median = 1.5_wp
    real(wp), parameter :: frame_largest = 3.0_wp
    real(wp), parameter :: orthogonal = 1.0e-14_wp
    real(wp), parameter :: chain_norms = 1.0e-13_wp
    real(wp), parameter :: chain_space = 3.0e-13_wp

    ! Elliptic functions and Gauss points.
    real(wp), parameter :: rf_error = 4.0_wp
    real(wp), parameter :: rc_error = 4.0_wp
    real(wp), parameter :: rj_error = 6.0_wp
    real(wp), parameter :: k_error = 4.0_wp
    real(wp), parameter :: f_error = 6.0_wp
    real(wp), parameter :: am_error = 4.0_wp
    real(wp), parameter :: pi_error = 8.0_wp
    real(wp), parameter :: nodes_error = 1.0_wp
    real(wp), parameter :: weight_error = 1.0_wp
    real(wp), parameter :: far_weight_error = 8.0_wp

    ! Splitting: energy of the paper's top; compensated, of the Hairer-Vilmart top in epsilon; there and back.
    real(wp), parameter :: top_energy = 1.0e-13_wp
    real(wp), parameter :: compensated_energy = 32.0_wp
    real(wp), parameter :: reversed = 1.0e-12_wp

end module frb_claims
