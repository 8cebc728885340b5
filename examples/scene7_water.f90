!> A drop of 64 rigid water molecules: a loop written by a user, with centres, momenta, attitudes and angular
!> momenta, in batches: `run_water` in water_model.inc. With velocity Verlet nearly all error comes from the
!> splitting between forces and motion, and the exact rotation gains nothing over the turns of NO_SQUISH. With
!> a scheme of order 4 these turns, of order 2, make the error much larger.
!>
!> `scene7_water 20` runs for 20 ps instead of 1.
module frb_water
    use frb, only: wp, rigid_body, free_flow, splitting_plan, quat_product, quat_conjugate, quat_to_matrix
    implicit none
    private

    public :: cluster, load, energy, run_water

    include 'water_model.inc'

end module frb_water

program scene7_water
    use frb, only: wp, splitting_plan, splitting_scheme
    use frb_water, only: cluster, load, energy, run_water
    implicit none
    type(splitting_scheme) :: verlet
    type(cluster) :: start
    character(16) :: argument
    real(wp) :: picoseconds

    picoseconds = 1.0_wp
    call get_command_argument(1, argument)
    if (argument /= '') read (argument, *) picoseconds
    call load('data/water64_start.txt', start)
    print '(a,f17.9,a)', 'total energy', energy(start), ' kcal/mol'
    print '(a)', 'scheme   step/fs  forces/fs   energy: rms about its line [kcal/mol]'
    print '(a)', '                              free_flow   NO_SQUISH'
    verlet = splitting_scheme([1.0_wp], [0.5_wp, 0.5_wp], 'verlet')
    call compare(verlet, 1.0_wp)
    call compare(splitting_scheme('srkn6'), 4.0_wp)

contains

    subroutine compare(scheme, h)
        type(splitting_scheme), intent(in) :: scheme
        real(wp), intent(in) :: h
        real(wp), parameter :: spacing = 12.0_wp        ! time between samples of the energy [fs]
        real(wp) :: rms(2)

        call run_water(splitting_plan(scheme, h), h, 1000*picoseconds, spacing, .false., start, rms(1))
        call run_water(splitting_plan(scheme, h), h, 1000*picoseconds, spacing, .true., start, rms(2))
        print '(a9,f7.1,f11.2,2es12.2)', scheme%name, h, scheme%stages()/h, rms
    end subroutine compare

end program scene7_water

! Output:
!   total energy   -511.634916089 kcal/mol
!   scheme   step/fs  forces/fs   energy: rms about its line [kcal/mol]
!                                 free_flow   NO_SQUISH
!   verlet       1.0       1.00    1.37E-02    1.38E-02
!   srkn6        4.0       1.50    7.17E-06    2.21E-03
