!> A drop of 64 rigid water molecules: a loop of one's own with centres, momenta, attitudes and angular
!> momenta, in batches. With velocity Verlet the splitting between forces and motion makes the whole error,
!> and the exact rotation gains nothing over the turns of NO_SQUISH; they hold a scheme of order 4 at order 2.
!>
!> `scene7_water 20` runs for 20 ps instead of 1.
module frb_water
    use frb, only: wp, rigid_body, free_flow, quat_product, quat_conjugate, quat_to_matrix
    implicit none
    private

    public :: cluster, load, forces, energy, drift, fluctuation, water_moments

    include 'water_model.inc'

end module frb_water

program scene7_water
    use frb, only: wp, rigid_body, splitting_plan, splitting_scheme
    use frb_water, only: cluster, load, forces, energy, drift, fluctuation, water_moments
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
        real(wp) :: rms(2)

        call run(splitting_plan(scheme, h), h, .false., rms(1))
        call run(splitting_plan(scheme, h), h, .true., rms(2))
        print '(a9,f7.1,f11.2,2es12.2)', scheme%name, h, scheme%stages()/h, rms
    end subroutine compare

    !> The energy is looked at every 12 fs, after a whole step.
    subroutine run(plan, h, squish, rms)
        type(splitting_plan), intent(in) :: plan
        real(wp), intent(in) :: h
        logical, intent(in) :: squish
        real(wp), intent(out) :: rms
        real(wp), parameter :: spacing = 12.0_wp
        type(cluster) :: box
        type(rigid_body) :: water
        real(wp) :: series(0:nint(1000*picoseconds/spacing))
        integer :: step, stage, every

        water = rigid_body(water_moments())
        every = nint(spacing/h)
        box = start
        series(0) = energy(box)
        do step = 1, every*ubound(series, 1)
            do stage = 1, plan%stages
                if (abs(plan%drift(stage)) > 0.0_wp) then
                    call drift(water, plan%drift(stage), squish, box)
                    call forces(box)        ! else those of the step before still hold
                end if
                box%p = box%p + plan%kick(stage)*box%force
                box%m = box%m + plan%kick(stage)*box%tau
            end do
            if (mod(step, every) == 0) series(step/every) = energy(box)
        end do
        rms = fluctuation(series)
    end subroutine run

end program scene7_water

! Output:
!   total energy   -511.634916089 kcal/mol
!   scheme   step/fs  forces/fs   energy: rms about its line [kcal/mol]
!                                 free_flow   NO_SQUISH
!   verlet       1.0       1.00    1.37E-02    1.38E-02
!   srkn6        4.0       1.50    7.17E-06    2.21E-03
